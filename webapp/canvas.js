// The 2D view inside viser's page: canvas.py sends this file, then calls window.openCanvas.
//
// viser has no 2D camera, so this works on the objects that its client exposes for its own browser
// tests (__viserMutable, __viserTestpoints). The picture is a plane that the camera faces squarely:
// its image on screen is a similarity, described by {scale, left, top} in CSS pixels.
"use strict";

window.openCanvas = ({
  rows, columns, planes, relief, worldHeight, hoverId, pickId, keyId, viewId, lightId,
}) => {
  window.photolin?.close();

  const ROTATE = 1, TRUCK = 2, TOUCH_ROTATE = 64, TOUCH_TRUCK = 128, TOUCH_DOLLY_TRUCK = 4096; // camera-controls ACTION
  const NEAREST = 1003; // three.js NearestFilter
  const MARGIN = 0.98, GRID_SCALE = 16, CLOSEST = 128; // CLOSEST: CSS pixels per image pixel
  const HOVER_MS = 50, VIEW_MS = 150;
  const CLICK_PIXELS = 3; // a pointer that moves farther drags
  const CAMERA_KEYS = /^(Key[WASDQE]|Arrow(Up|Down|Left|Right))$/;

  const viewer = window.__viserMutable;
  const { canvas, camera, scene } = viewer;
  const worldPixel = worldHeight / rows;
  const closing = new AbortController();
  const listen = (target, type, listener, capture = false) =>
    target.addEventListener(type, listener, { capture, signal: closing.signal });
  const send = (uuid, value) =>
    viewer.sendMessage({ type: "GuiUpdateMessage", uuid, updates: { value } });

  let reports = 0;
  /** Send an event, numbered, because the same value again would be no change of the widget. */
  const report = (uuid, text) => text && send(uuid, `${++reports} ${text}`);

  // --- camera ---

  let size = null; // [width, height] of the canvas that the camera was placed for
  let fitted = null; // pose that fit() chose, to stay fitted when the window changes
  let peeking = false; // space bar held: without overlay
  let orbiting = false; // the picture lies on the relief, and the camera turns around it

  const hasPicture = () => Boolean(viewer.nodeRefFromName[planes[0]] && viewer.cameraControl);
  const placed = () => size !== null && hasPicture();
  const focalLength = () => canvas.clientHeight / 2 / Math.tan((camera.fov * Math.PI) / 360);
  const distanceAt = (scale) => (focalLength() * worldPixel) / scale;
  const fitScale = () =>
    MARGIN * Math.min(canvas.clientWidth / columns, canvas.clientHeight / rows);

  /** Axes of the picture in three.js coordinates: right, down, into the picture, and its centre. */
  function axes() {
    const m = viewer.nodeRefFromName[planes[0]].matrixWorld;
    const vectors = [0, 1, 2].map((i) => camera.position.clone().setFromMatrixColumn(m, i));
    return [...vectors, camera.position.clone().setFromMatrixPosition(m)];
  }

  /** Look squarely at `target` from `distance`, and forbid any rotation from there. */
  function place(target, distance) {
    const controls = viewer.cameraControl;
    const [, down, into] = axes();
    const position = target.clone().addScaledVector(into, -distance);
    Object.assign(controls, {
      minAzimuthAngle: -Infinity, maxAzimuthAngle: Infinity, minPolarAngle: 0, maxPolarAngle: Math.PI,
      minDistance: distanceAt(Math.max(CLOSEST, 4 * fitScale())),
    });
    viewer.configuredMaxOrbitDistance = controls.maxDistance = distanceAt(fitScale() / 8);
    camera.up.copy(down).negate();
    controls.updateCameraUp();
    controls.setPosition(position.x, position.y, position.z, false);
    controls.setTarget(target.x, target.y, target.z, false);
    controls.minAzimuthAngle = controls.maxAzimuthAngle = controls.azimuthAngle;
    controls.minPolarAngle = controls.maxPolarAngle = controls.polarAngle;
    controls.update(1e-3); // moves the camera now, not with the next frame
    size = [canvas.clientWidth, canvas.clientHeight];
    viewer.requestRender();
  }

  function pose() {
    const controls = viewer.cameraControl;
    return { target: controls.getTarget(camera.position.clone()), distance: controls.distance };
  }

  function fit() {
    place(axes()[3], distanceAt(fitScale()));
    fitted = pose();
    if (orbiting) unlock();
  }

  /** Let the camera turn around the relief, from where it is. */
  function unlock() {
    const controls = viewer.cameraControl;
    Object.assign(controls, {
      minAzimuthAngle: -Infinity, maxAzimuthAngle: Infinity, minPolarAngle: 0, maxPolarAngle: Math.PI,
    });
    controls.mouseButtons.left = ROTATE;
    controls.touches.one = TOUCH_ROTATE;
    controls.dollyToCursor = false;
  }

  /** Lay the picture on the relief and turn around it, or go back to the flat picture. */
  function setOrbit(on) {
    if (on === orbiting) return;
    orbiting = on;
    layer.classList.toggle("photolin-orbit", on);
    grid.hidden = true;
    // near and far decide how finely depths are told apart
    Object.assign(camera, on ? { near: 0.1, far: 1e3 } : { near: 1e-4, far: 1e4 });
    camera.updateProjectionMatrix();
    if (!hasPicture()) return;
    if (!on) lock();
    fit();
  }

  function lock() {
    const controls = viewer.cameraControl;
    controls.mouseButtons.left = controls.mouseButtons.right = TRUCK;
    controls.touches.one = TOUCH_TRUCK;
    controls.touches.two = controls.touches.three = TOUCH_DOLLY_TRUCK;
    controls.dollyToCursor = true;
  }

  /** Meshes of the relief: its surface, and the same again for the overlay; none without one. */
  const dressed = new Map(); // geometry of a surface -> [picture, overlay]

  function dressRelief() {
    const node = viewer.nodeRefFromName[relief];
    const maps = planes.map((name) => {
      let found = null;
      viewer.nodeRefFromName[name]?.traverse((mesh) => (found ??= mesh.isMesh && mesh.material.map ? mesh : null));
      return found;
    });
    const sources = [];
    node?.traverse((mesh) => mesh.isMesh && !mesh.userData.photolin && sources.push(mesh));
    for (const source of sources) {
      if (!maps[0]) continue;
      if (!dressed.has(source.geometry)) dressed.set(source.geometry, dress(source, maps[0].material));
      source.material.visible = false;
      dressed.get(source.geometry).forEach((mesh, order) => {
        const map = maps[order]?.material.map ?? null;
        if (mesh.material.map !== map) {
          mesh.material.map = map;
          mesh.material.needsUpdate = true;
        }
        mesh.visible = orbiting && Boolean(map) && planeShown(order);
      });
    }
  }

  const planeShown = (order) =>
    !(peeking && order > 0) && Boolean(viewer.nodeRefFromName[planes[order]]?.visible ?? true);

  /** Two meshes with the geometry of `source` that show pictures as they are, without light. */
  function dress(source, like) {
    const { geometry } = source;
    const at = geometry.attributes.position;
    const uv = new Float32Array(2 * at.count);
    for (let n = 0; n < at.count; n++) {
      uv[2 * n] = at.getX(n) / (columns * worldPixel) + 0.5;
      uv[2 * n + 1] = 0.5 - at.getY(n) / worldHeight;
    }
    geometry.setAttribute("uv", new at.constructor(uv, 2));
    return planes.map((_, order) => {
      const material = new like.constructor({ side: 2, toneMapped: false, transparent: order > 0 });
      const mesh = new source.constructor(geometry, material);
      mesh.userData.photolin = true;
      mesh.renderOrder = order;
      source.add(mesh);
      return mesh;
    });
  }

  /** One image pixel on one pixel of the device, around the present centre, edges on edges. */
  function oneToOne() {
    const [right, down, , centre] = axes();
    const offset = pose().target.sub(centre).divideScalar(worldPixel);
    const snap = (along, pixels, deviceSize) =>
      Math.round(along - (pixels - deviceSize) / 2) + (pixels - deviceSize) / 2;
    const x = snap(offset.dot(right), columns, canvas.width);
    const y = snap(offset.dot(down), rows, canvas.height);
    const target = centre.addScaledVector(right, x * worldPixel).addScaledVector(down, y * worldPixel);
    place(target, distanceAt(1 / window.devicePixelRatio));
  }

  function followSize() {
    const { target, distance } = pose();
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === size[0] && height === size[1]) return;
    const stillFitted =
      fitted && Math.abs(distance / fitted.distance - 1) < 1e-6 &&
      target.distanceTo(fitted.target) < 1e-6 * distance;
    if (stillFitted) fit();
    else place(target, (distance * height) / size[1]); // the same scale as before
  }

  function similarity() {
    const [right, down, into, centre] = axes();
    const offset = centre.sub(camera.position);
    const zoom = focalLength() / offset.dot(into);
    const scale = zoom * worldPixel;
    return {
      scale,
      left: canvas.clientWidth / 2 + zoom * offset.dot(right) - (scale * columns) / 2,
      top: canvas.clientHeight / 2 + zoom * offset.dot(down) - (scale * rows) / 2,
    };
  }

  // --- before each frame ---

  function beforeRender() {
    if (!hasPicture()) return;
    if (size === null) configure();
    else if (!orbiting) followSize();
    planes.forEach((name, order) =>
      viewer.nodeRefFromName[name]?.traverse((mesh) => {
        if (!mesh.isMesh || !("map" in mesh.material)) return;
        const { material } = mesh;
        mesh.visible = Boolean(material.map) && !(peeking && order > 0) && !orbiting;
        mesh.renderOrder = order; // planes lie in one another: drawn in turn, without depth
        material.depthTest = material.depthWrite = false;
        if (material.map && material.map.magFilter !== NEAREST) {
          material.map.magFilter = NEAREST;
          material.map.needsUpdate = true;
        }
      }),
    );
    dressRelief();
    drawMarks();
    if (!orbiting) tellView();
  }

  let viewed = "", viewTimer = null;

  /** Tell which part of the picture is on screen, "row0,row1,column0,column1,device pixels per pixel". */
  function tellView() {
    const { scale, left, top } = similarity();
    const part = (start, length, count) => [
      Math.max(0, Math.min(count, Math.floor(-start / scale))),
      Math.max(0, Math.min(count, Math.ceil((length - start) / scale))),
    ];
    const [r, c] = [part(top, canvas.clientHeight, rows), part(left, canvas.clientWidth, columns)];
    const view = [...r, ...c, (scale * window.devicePixelRatio).toFixed(3)].join(",");
    if (view === viewed) return;
    viewed = view;
    clearTimeout(viewTimer);
    viewTimer = setTimeout(() => send(viewId, viewed), VIEW_MS);
  }

  function configure() {
    Object.assign(camera, { fov: 30, near: 1e-4, far: 1e4 });
    camera.updateProjectionMatrix();
    lock();
    fit();
  }

  // --- marks drawn over the picture ---

  const layer = document.createElement("div");
  layer.style.cssText = "position:absolute;inset:0;overflow:hidden;pointer-events:none";
  canvas.parentElement.append(layer);
  const grid = layer.appendChild(document.createElement("div"));
  const readout = layer.appendChild(document.createElement("div"));
  readout.style.cssText =
    "position:absolute;left:0;bottom:0;padding:.3em .8em;border-radius:0 6px 0 0;white-space:pre;" +
    "font:13px ui-monospace,monospace;color:#fff;background:rgba(0,0,0,.72)";
  readout.hidden = true;

  function setReadout(text) {
    readout.textContent = text;
    readout.hidden = text === "";
  }
  const marks = []; // {element, row, column}
  const RING =
    "position:absolute;box-sizing:border-box;border:2px solid #fff;" +
    "outline:1px solid #000;box-shadow:inset 0 0 0 1px #000";
  const PIN =
    "position:absolute;padding:0 4px;border-radius:8px;font:600 11px/16px system-ui;" +
    "color:#fff;background:#000c;border:1px solid #fff;transform:translate(6px,-22px)";

  /** Marks: [row, column, text] each; a mark without text rings its pixel. */
  function setMarks(list) {
    marks.splice(0).forEach((mark) => mark.element.remove());
    for (const [row, column, text] of list) {
      const element = layer.appendChild(document.createElement("div"));
      element.className = text ? "photolin-pin" : "photolin-marker";
      element.style.cssText = text ? PIN : RING;
      element.textContent = text;
      marks.push({ element, row, column, ring: !text });
    }
    viewer.requestRender();
  }

  function drawMarks() {
    for (const { element } of marks) element.hidden = orbiting;
    if (orbiting) return;
    const { scale, left, top } = similarity();
    for (const { element, row, column, ring } of marks) {
      const side = ring ? Math.max(scale + 4, 13) : 0;
      element.style.left = `${left + (column + 0.5) * scale - side / 2}px`;
      element.style.top = `${top + (row + 0.5) * scale - side / 2}px`;
      if (ring) element.style.width = element.style.height = `${side}px`;
    }
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

  // --- the light that a relit picture is seen under ---

  const BALL = 110; // CSS pixels
  const ball = layer.appendChild(document.createElement("div"));
  ball.className = "photolin-light";
  ball.title = "Drag: the light that the picture is seen under (middle: from the camera, rim: grazing)";
  ball.style.cssText =
    `position:absolute;right:14px;bottom:14px;width:${BALL}px;height:${BALL}px;border-radius:50%;` +
    "pointer-events:auto;cursor:grab;touch-action:none;border:1px solid #fff8;box-shadow:0 0 0 1px #0008";
  const spot = ball.appendChild(document.createElement("div"));
  spot.style.cssText =
    "position:absolute;width:12px;height:12px;margin:-6px 0 0 -6px;border-radius:50%;" +
    "background:#ffd43b;border:1px solid #000;pointer-events:none";
  ball.hidden = true;

  /** Show the light ball with its spot at x right, y up, of a unit direction; null hides it. */
  function setLight(light) {
    ball.hidden = light === null;
    if (light !== null && !ball.matches(":active")) drawLight(...light);
  }

  function drawLight(x, y) {
    const [left, top] = [50 + 50 * x, 50 - 50 * y];
    spot.style.left = `${left}%`;
    spot.style.top = `${top}%`;
    ball.style.background = `radial-gradient(circle at ${left}% ${top}%, #e8e8e8, #333 75%)`;
  }

  let lightTimer = null, light = null;

  function dragLight(event) {
    if (!(event.buttons & 1)) return;
    const box = ball.getBoundingClientRect();
    let x = (2 * (event.clientX - box.left)) / box.width - 1;
    let y = 1 - (2 * (event.clientY - box.top)) / box.height;
    const length = Math.hypot(x, y);
    if (length > 0.99) [x, y] = [(0.99 * x) / length, (0.99 * y) / length];
    drawLight(x, y);
    light = `${x.toFixed(4)},${y.toFixed(4)}`;
    lightTimer ??= setTimeout(() => {
      lightTimer = null;
      send(lightId, light);
    }, HOVER_MS);
  }

  // --- pointer and keys ---

  let hovered = "", hoverTimer = null;

  function hover(position) {
    if (position === hovered) return;
    hovered = position;
    hoverTimer ??= setTimeout(() => {
      hoverTimer = null;
      send(hoverId, hovered);
    }, HOVER_MS);
  }

  /** The ray through the pointer in pixels: "ray column,row,height,..." of the eye and a direction. */
  function rayUnder(event) {
    const box = canvas.getBoundingClientRect();
    const middle = 0.5 / window.devicePixelRatio;
    const far = camera.position.clone().set(
      (2 * (event.clientX + middle - box.left)) / canvas.clientWidth - 1,
      1 - (2 * (event.clientY + middle - box.top)) / canvas.clientHeight,
      0.5,
    );
    const [right, down, into, centre] = axes();
    const direction = far.unproject(camera).sub(camera.position).normalize();
    const eye = camera.position.clone().sub(centre).divideScalar(worldPixel);
    const inPixels = (v, c, r) => [v.dot(right) + c, v.dot(down) + r, -v.dot(into)];
    const numbers = [...inPixels(eye, columns / 2, rows / 2), ...inPixels(direction, 0, 0)];
    return `ray ${numbers.map((n) => n.toFixed(6)).join(",")}`;
  }

  /** The pixel under the middle of the device pixel that the pointer is on, "" beside the picture. */
  function pixelUnder(event) {
    if (!placed()) return "";
    if (orbiting) return rayUnder(event);
    const box = canvas.getBoundingClientRect();
    const { scale, left, top } = similarity();
    const middle = 0.5 / window.devicePixelRatio;
    const row = Math.floor((event.clientY - box.top + middle - top) / scale);
    const column = Math.floor((event.clientX - box.left + middle - left) / scale);
    const inside = row >= 0 && row < rows && column >= 0 && column < columns;
    return inside ? `${row},${column}` : "";
  }

  let pressed = null; // pointerdown that may become a click

  function release(event) {
    const moved = pressed && Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY);
    if (pressed && moved <= CLICK_PIXELS) report(pickId, pixelUnder(event));
    pressed = null;
  }

  const isList = (widget) => widget.getAttribute?.("role") === "combobox";

  /** Whether a text or number is being typed there, or something chosen from an open list. */
  function isBusy(widget) {
    if (isList(widget)) return widget.getAttribute("aria-expanded") === "true";
    const kind = widget.tagName === "INPUT" ? widget.type : widget.tagName;
    return widget.isContentEditable || /^(TEXTAREA|SELECT|text|number|search)$/.test(kind);
  }

  /** Whether the focused widget uses this key itself. */
  function isForWidget({ key, target }) {
    if (isBusy(target)) return true;
    if (target === document.body || target === canvas) return false;
    const movable = /^(slider|tab|radio)$/.test(target.getAttribute?.("role") ?? target.type);
    return key === " " || key === "Enter" || key === "Tab" || (movable && key.startsWith("Arrow"));
  }

  /** Whoever works with the pointer, or has chosen from a list, has the keys for the picture. */
  function giveFocusBack() {
    const focused = document.activeElement;
    if (focused && !isBusy(focused)) focused.blur(); // Tab still goes on from there
  }

  const local = { f: fit, g: oneToOne, " ": () => peek(true) };

  function peek(on) {
    peeking = on;
    viewer.requestRender();
  }

  function onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || isForWidget(event)) return;
    const action = local[event.key.toLowerCase()];
    const reported = event.key.length === 1 || /^(Arrow.*|Escape)$/.test(event.key);
    if (!action && !reported) return;
    if (isList(event.target)) {
      event.stopPropagation(); // it would open again
      giveFocusBack();
    }
    if (!action) return report(keyId, event.key);
    event.preventDefault();
    if (!event.repeat && placed()) action();
  }

  for (const type of ["pointerdown", "pointermove"]) listen(ball, type, dragLight);
  listen(ball, "pointerdown", (event) => ball.setPointerCapture(event.pointerId));
  listen(canvas, "pointermove", (event) => hover(pixelUnder(event)));
  listen(canvas, "pointerleave", () => hover(""));
  listen(canvas, "pointerdown", (event) => {
    pressed = event.isPrimary && event.button === 0 ? event : null;
  });
  listen(canvas, "pointerup", release);
  listen(canvas, "dblclick", () => placed() && fit());
  // After the widget has had the click; those made with the keyboard have no detail.
  listen(window, "click", ({ detail }) => detail > 0 && setTimeout(giveFocusBack), true);
  listen(window, "keydown", onKey, true);
  listen(window, "keyup", (event) => event.key === " " && peeking && peek(false), true);
  listen(window, "blur", () => peeking && peek(false));
  // viser moves its camera by listeners on `document`, even while a slider has the focus: stop the
  // keys one step below, after every widget has had them.
  listen(document.documentElement, "keydown", (event) => {
    if (CAMERA_KEYS.test(event.code)) event.stopPropagation();
  });

  // --- settings of the page ---

  // The panel's scroll bar lies over the right end of its boxes and buttons.
  const style = document.head.appendChild(document.createElement("style"));
  style.textContent = ".mantine-ScrollArea-content .mantine-ScrollArea-content{padding-right:6px}";

  // viser lowers the resolution on slow machines, which blurs pixels.
  const fixResolution = () =>
    window.__viserTestpoints.devSettings.set({
      fixedDpr: window.devicePixelRatio,
      enableOrbitCrosshair: false,
    });
  fixResolution();
  listen(window, "resize", fixResolution);

  // The note on software WebGL covers the picture.
  for (const note of document.querySelectorAll(".mantine-Notification-root")) {
    if (!note.textContent.includes("Software WebGL")) continue;
    note.style.display = "none"; // at once: it takes clicks while it fades
    note.querySelector("button")?.click();
  }

  // "Reset View" and changes of the world's orientation end here.
  Object.defineProperty(viewer, "resetCameraPose", {
    configurable: true,
    get: () => () => placed() && fit(),
    set: () => {},
  });
  scene.onBeforeRender = beforeRender;
  viewer.requestRender();

  function close() {
    closing.abort();
    clearTimeout(hoverTimer);
    clearTimeout(viewTimer);
    clearTimeout(lightTimer);
    layer.remove();
    style.remove();
    scene.onBeforeRender = () => {};
  }

  window.photolin = {
    fit: () => placed() && fit(),
    oneToOne: () => placed() && oneToOne(),
    similarity: () => (placed() ? similarity() : null),
    setMarks,
    setOrbit,
    setLight,
    setReadout,
    close,
  };
};
