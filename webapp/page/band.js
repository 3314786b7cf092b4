// Samples: the rectangle that is being drawn on the picture, and the outlines of those taken.

function openBand({ viewer, layer, listen, rows, columns, camera, bandId, send, CLICK_PIXELS }) {
  const SMALLEST = 7; // CSS pixels: an outline of less would not be seen
  const LOOK = "position:absolute;box-sizing:border-box;border:2px solid;outline:1px solid #0009;outline-offset:0";
  const FILL = "33"; // alpha of the rectangle being drawn

  const { canvas } = viewer;

  let colour = null; // of what is sampled; null: nothing is
  let drag = null; // {pointer, x, y, from, to, far}; from and to are [row, column], with fractions
  let reports = 0;
  let boxes = []; // {element, box}

  const band = add("photolin-band");
  band.hidden = true;

  function add(className) {
    const element = document.createElement("div");
    element.className = className;
    layer.prepend(element); // under marks and text
    return element;
  }

  /** Let drags sample pixels, outlined in a CSS colour "#rrggbb"; null: they move the picture. */
  function setSampling(value) {
    colour = value;
    if (colour === null) stop();
    canvas.style.cursor = colour === null ? "" : "crosshair";
  }

  /** Outline boxes: [row0, row1, column0, column1, CSS colour] each. */
  function setBoxes(list) {
    boxes.forEach(({ element }) => element.remove());
    boxes = list.map(([...box]) => {
      const element = add("photolin-box");
      element.style.cssText = `${LOOK};border-color:${box[4]}`;
      return { element, box };
    });
    viewer.requestRender();
  }

  const isSampling = () => colour !== null && camera.placed() && !camera.isOrbiting();

  /** [row, column] under the pointer, with fractions; it may lie beside the picture. */
  function at({ clientX, clientY }) {
    const canvasBox = canvas.getBoundingClientRect();
    const { scale, left, top } = camera.similarity();
    const x = clientX - canvasBox.left;
    const beyond = camera.half() > 0 && x >= camera.half(); // in the right one of two views
    return [(clientY - canvasBox.top - top) / scale, (x - (beyond ? camera.half() : 0) - left) / scale];
  }

  /** Whole pixels between two corners, [row0, row1, column0, column1]; null beside the picture. */
  function boxBetween(from, to) {
    const part = [0, 1].flatMap((axis) => [
      Math.max(Math.floor(Math.min(from[axis], to[axis])), 0),
      Math.min(Math.ceil(Math.max(from[axis], to[axis])), [rows, columns][axis]),
    ]);
    return part[0] < part[1] && part[2] < part[3] ? part : null;
  }

  function start(event) {
    if (event.target !== canvas) return;
    if (drag) return stop(); // a second finger
    const samples = isSampling() && event.isPrimary && event.button === 0 && !event.shiftKey;
    camera.setPanning(!samples); // before the camera hears of it
    if (!samples) return;
    const place = at(event);
    drag = { pointer: event.pointerId, x: event.clientX, y: event.clientY, from: place, to: place, far: false };
    canvas.setPointerCapture(event.pointerId); // to hear of its end outside the window too
  }

  function move(event) {
    if (event.pointerId !== drag?.pointer) return;
    if (!isSampling()) return stop();
    drag.to = at(event);
    drag.far = Math.hypot(event.clientX - drag.x, event.clientY - drag.y) > CLICK_PIXELS;
    drawBand();
  }

  function finish(event) {
    if (event.pointerId !== drag?.pointer) return;
    move(event);
    const box = drag?.far ? boxBetween(drag.from, drag.to) : null;
    stop();
    if (box) send(bandId, `${++reports} ${box.join(",")}`);
  }

  function stop() {
    drag = null;
    band.hidden = true;
  }

  function drawBand() {
    const box = drag?.far ? boxBetween(drag.from, drag.to) : null;
    band.hidden = box === null;
    if (box === null) return;
    band.style.cssText = `${LOOK};border-color:${colour};background:${colour}${FILL}`;
    put(band, box, camera.similarity());
  }

  function put({ style }, [row0, row1, column0, column1], { scale, left, top }) {
    const [width, height] = [column1 - column0, row1 - row0].map((n) => Math.max(n * scale, SMALLEST));
    style.left = `${left + ((column0 + column1) * scale - width) / 2}px`;
    style.top = `${top + ((row0 + row1) * scale - height) / 2}px`;
    style.width = `${width}px`;
    style.height = `${height}px`;
  }

  /** Before each frame, as the picture may have moved. */
  function draw() {
    const solid = camera.isOrbiting();
    if (solid) stop();
    for (const { element, box } of boxes) {
      element.hidden = solid;
      if (!solid) put(element, box, camera.similarity());
    }
    drawBand();
  }

  listen(window, "pointerdown", start, true);
  listen(window, "pointermove", move);
  listen(window, "pointerup", finish);
  listen(window, "pointercancel", stop);
  listen(window, "blur", stop);
  listen(window, "keydown", (event) => {
    if (event.key !== "Escape" || !drag) return;
    stop();
    event.stopImmediatePropagation(); // it would stop more than this
  }, true);

  return { setSampling, setBoxes, draw, isSampling };
}
