// A second picture: from a line on that is dragged, alone, or in a view of its own.
//
// Both pictures are planes in one place. Each is cut to the columns that it shows, so a line that
// moves costs no message; in a view of its own the second one is also moved, half a window right.

function openCompare({ viewer, layer, listen, rows, columns, worldHeight, camera, dividerId, sender }) {
  const HOLD_MS = 1000; // after a drag, in which older places that the server has heard of do not count
  const GRIP =
    "position:absolute;width:13px;margin-left:-6px;pointer-events:auto;cursor:col-resize;touch-action:none";
  const LINE =
    "position:absolute;left:5px;top:0;bottom:0;width:2px;background:#fff;box-shadow:0 0 0 1px #000c";
  const KNOB =
    "position:absolute;left:-5px;top:50%;width:22px;height:22px;margin-top:-11px;border-radius:50%;" +
    "font:700 13px/22px system-ui;text-align:center;color:#000;background:#fff;box-shadow:0 0 0 1px #000c";

  const { canvas } = viewer;
  const worldWidth = (worldHeight * columns) / rows;
  const post = sender(dividerId);
  let arrangement = null; // "split", "side by side", "left", "right"; null: one picture
  let divider = 0.5; // share of the width
  let dragged = -Infinity; // when the line was last dragged

  const bar = layer.appendChild(document.createElement("div"));
  bar.className = "photolin-divider";
  bar.title = "Drag to move the line between both pictures";
  bar.hidden = true;
  const line = bar.appendChild(document.createElement("div"));
  line.style.cssText = LINE;
  const knob = bar.appendChild(document.createElement("div"));
  knob.style.cssText = KNOB;
  knob.textContent = "↔";

  /** Arrange both pictures, the second from the share `at` of the width on. */
  function set(how, at) {
    arrangement = how;
    if (performance.now() - dragged > HOLD_MS) divider = at;
    camera.setHalves(how === "side by side" ? 2 : 1);
    viewer.requestRender();
  }

  /** The part of each picture that is shown: [from, to, moved], shares of its width; before each frame. */
  function spans() {
    const all = [0, 1, 0], none = [0, 0, 0];
    if (arrangement === null || arrangement === "left") return [all, none];
    if (arrangement === "right") return [none, all];
    if (arrangement === "split") {
      const at = Math.round(divider * columns) / columns;
      return [[0, at, 0], [at, 1, 0]];
    }
    const { scale, left } = camera.similarity();
    const [width, half] = [scale * columns, camera.half()];
    const share = (x) => Math.min(Math.max((x - left) / width, 0), 1);
    return [[0, share(half), 0], [share(0), share(half), half / width]];
  }

  /** Cut the mesh of a picture to a span of it. */
  function cut(mesh, [from, to, moved]) {
    const { map } = mesh.material;
    if (!map || to <= from) return void (mesh.visible = false);
    mesh.scale.x = map.repeat.x = to - from;
    map.offset.x = from;
    mesh.position.x = worldWidth * ((from + to - 1) / 2 + moved);
    mesh.updateMatrixWorld(); // those of this frame are made already
  }

  /** The line between both; before each frame. */
  function draw() {
    bar.hidden = !(arrangement === "split" || arrangement === "side by side");
    if (bar.hidden) return;
    const { scale, left, top } = camera.similarity();
    const movable = arrangement === "split";
    const from = movable ? Math.max(top, 0) : 0;
    const to = movable ? Math.min(top + rows * scale, canvas.clientHeight) : canvas.clientHeight;
    const x = movable ? left + Math.round(divider * columns) * scale : camera.half();
    bar.style.cssText = `${GRIP};left:${x}px;top:${from}px;height:${Math.max(to - from, 0)}px`;
    if (!movable) bar.style.pointerEvents = "none";
    knob.hidden = !movable;
  }

  function drag(event) {
    if (!(event.buttons & 1)) return;
    const { scale, left } = camera.similarity();
    const x = event.clientX - canvas.getBoundingClientRect().left;
    divider = Math.min(Math.max((x - left) / scale / columns, 0), 1);
    dragged = performance.now();
    post(divider.toFixed(4));
    viewer.requestRender();
  }

  /** Have the camera hear of the wheel as if the pointer were at the same place of the first view. */
  function zoom(event) {
    const x = event.clientX - canvas.getBoundingClientRect().left;
    const beyond = camera.half() > 0 && x >= camera.half();
    if (!event.isTrusted || !(event.target === bar || bar.contains(event.target) || beyond)) return;
    event.preventDefault();
    event.stopPropagation();
    const { deltaX, deltaY, deltaMode, clientX, clientY, ctrlKey } = event;
    canvas.dispatchEvent(
      new WheelEvent("wheel", {
        ...{ deltaX, deltaY, deltaMode, clientY, ctrlKey, bubbles: true, cancelable: true },
        clientX: beyond ? clientX - camera.half() : clientX,
      }),
    );
  }

  for (const type of ["pointerdown", "pointermove"]) listen(bar, type, drag);
  listen(bar, "pointerdown", (event) => {
    event.stopPropagation(); // it would move the picture too
    bar.setPointerCapture(event.pointerId);
  });
  listen(canvas.parentElement, "wheel", zoom, true);

  return { set, spans, cut, draw };
}
