// What is drawn over the picture: the selected pixel, pins, the grid of pixels, one line of text.

function openMarks({ viewer, layer, rows, columns, camera, relief }) {
  const GRID_SCALE = 16; // CSS pixels per image pixel from which pixels are told apart by lines
  const RING =
    "position:absolute;box-sizing:border-box;border:2px solid #fff;" +
    "outline:1px solid #000;box-shadow:inset 0 0 0 1px #000";
  const ROUND = ";border-radius:50%;outline:none;box-shadow:inset 0 0 0 1px #000,0 0 0 1px #000";
  const RING_3D = 15; // CSS pixels
  const PIN =
    "position:absolute;padding:0 4px;border-radius:8px;font:600 11px/16px system-ui;" +
    "color:#fff;background:#000c;border:1px solid #fff;transform:translate(6px,-22px)";
  const DOT =
    "position:absolute;width:7px;height:7px;margin:-3.5px;border-radius:50%;background:#fff;" +
    "box-shadow:0 0 0 1px #000";

  // two views beside each other have the same marks
  const [first, second] = [0, 1].map(() => layer.appendChild(document.createElement("div")));
  second.className = "photolin-second";
  const grid = first.appendChild(document.createElement("div"));
  const readout = layer.appendChild(document.createElement("div"));
  readout.className = "photolin-readout";
  readout.style.cssText =
    "position:absolute;z-index:2;left:0;bottom:0;padding:.3em .8em;border-radius:0 6px 0 0;white-space:pre-wrap;" +
    "font:.88rem ui-monospace,monospace;color:#fff;background:rgba(0,0,0,.72)";
  readout.hidden = true;

  const marks = []; // {elements, row, column, height, ring}

  function setReadout(text) {
    readout.textContent = text;
    readout.hidden = text === "";
  }

  function add(className, text) {
    const element = first.appendChild(document.createElement("div"));
    element.className = className;
    element.textContent = text;
    return element;
  }

  /** Marks: [row, column, text, height] each; one without text rings its pixel.
   *
   * Height is that of the surface, pixels; null where there is none. */
  function setMarks(list) {
    marks.splice(0).forEach(({ elements }) => elements.forEach((element) => element.remove()));
    for (const [row, column, text, height] of list) {
      const ring = !text;
      const elements = ring
        ? [add("photolin-marker", "")]
        : [add("photolin-dot", ""), add("photolin-pin", text)];
      if (!ring) elements.forEach((element, n) => (element.style.cssText = [DOT, PIN][n]));
      marks.push({ elements, row, column, height, ring });
    }
    viewer.requestRender();
  }

  function draw() {
    const half = camera.half();
    const view = (left) =>
      `position:absolute;top:0;bottom:0;overflow:hidden;left:${left}px;width:${half ? `${half}px` : "100%"}`;
    first.style.cssText = view(0);
    second.style.cssText = view(half);
    if (camera.isOrbiting()) drawSolid();
    else drawFlat();
    second.replaceChildren(...(half ? [...first.children].map((one) => one.cloneNode(true)) : []));
  }

  function drawFlat() {
    const { scale, left, top } = camera.similarity();
    for (const mark of marks) {
      const side = Math.max(scale + 4, 13);
      put(mark, left + (mark.column + 0.5) * scale, top + (mark.row + 0.5) * scale, side, RING);
    }
    drawGrid(scale, left, top);
  }

  /** On the surface, as far as it does not hide them. */
  function drawSolid() {
    grid.hidden = true;
    const eye = camera.eye();
    for (const mark of marks) {
      const point = [mark.column + 0.5, mark.row + 0.5, mark.height];
      const seen = mark.height !== null && !relief.hides(point, eye);
      if (seen) put(mark, ...camera.project(point), RING_3D, RING + ROUND);
      else mark.elements.forEach((element) => (element.hidden = true));
    }
  }

  function put({ elements, ring }, x, y, side, look) {
    for (const element of elements) {
      if (ring) {
        element.style.cssText = look;
        element.style.width = element.style.height = `${side}px`;
      }
      element.hidden = false;
      element.style.left = `${ring ? x - side / 2 : x}px`;
      element.style.top = `${ring ? y - side / 2 : y}px`;
    }
  }

  function drawGrid(scale, left, top) {
    grid.hidden = scale < GRID_SCALE;
    if (grid.hidden) return;
    const x = Math.max(left, 0), y = Math.max(top, 0);
    const line = "rgba(128,128,128,.45) 1px,transparent 1px";
    grid.style.cssText =
      `position:absolute;left:${x}px;top:${y}px;` +
      `width:${left + columns * scale - x}px;height:${top + rows * scale - y}px;` +
      `max-width:100%;max-height:100%;` +
      `background:linear-gradient(90deg,${line}) ${left - x}px 0/${scale}px 100%,` +
      `linear-gradient(${line}) 0 ${top - y}px/100% ${scale}px`;
  }

  return { setMarks, setReadout, draw };
}
