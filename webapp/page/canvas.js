// The picture inside viser's page: canvas.py sends these files as one function, then calls
// window.openCanvas. The other files of this folder are its parts; each opens one of them.

window.openCanvas = (options) => {
  window.photolin?.close();

  const NEAREST = 1003; // three.js NearestFilter
  const POST_MS = 50, VIEW_MS = 150;
  const CLICK_PIXELS = 3; // a pointer that moves farther drags

  const { rows, columns, planes, others, viewId } = options;
  const viewer = window.__viserMutable;
  const { canvas, scene } = viewer;
  const closing = new AbortController();
  const listen = (target, type, listener, capture = false) =>
    target.addEventListener(type, listener, { capture, signal: closing.signal });
  const send = (uuid, value) =>
    viewer.sendMessage({ type: "GuiUpdateMessage", uuid, updates: { value } });

  /** A function that sends the latest of the values it gets, where it is another, now and then. */
  function sender(uuid, milliseconds = POST_MS) {
    let latest = "", timer = null;
    closing.signal.addEventListener("abort", () => clearTimeout(timer));
    return (value) => {
      if (value === latest) return;
      latest = value;
      timer ??= setTimeout(() => {
        timer = null;
        send(uuid, latest);
      }, milliseconds);
    };
  }

  const layer = document.createElement("div");
  layer.style.cssText = "position:absolute;inset:0;overflow:hidden;pointer-events:none";
  canvas.parentElement.append(layer);

  let peeking = false; // space bar held: without overlay

  function peek(on) {
    if (on === peeking) return;
    peeking = on;
    viewer.requestRender();
  }

  const page = { ...options, viewer, layer, listen, send, sender, peek, CLICK_PIXELS };
  const camera = openCamera(page);
  const relief = openRelief(page);
  const marks = openMarks({ ...page, camera, relief });
  const light = openLight(page);
  const sketch = openSketch({ ...page, camera });
  const widgets = openWidgets(page);
  const compare = openCompare({ ...page, camera });
  const band = openBand({ ...page, camera });
  openInput({ ...page, camera, band, cards: openCards(page) });

  // --- before each frame ---

  function beforeRender() {
    if (!camera.hasPicture()) return;
    camera.follow();
    const isShown = (order) => !(peeking && order % 2 > 0); // pictures and overlays in turn
    const spans = compare.spans();
    const isVisible = (order) => viewer.nodeRefFromName[planes[order]]?.visible ?? true;
    const lies = relief.draw((order) => camera.isOrbiting() && isShown(order) && isVisible(order));
    [...planes, ...others].forEach((name, order) =>
      viewer.nodeRefFromName[name]?.traverse((mesh) => {
        if (!mesh.isMesh || !("map" in mesh.material)) return;
        const { material } = mesh;
        mesh.visible = Boolean(material.map) && isShown(order) && !(camera.isOrbiting() && lies);
        mesh.renderOrder = order; // planes lie in one another: drawn in turn, without depth
        material.depthTest = material.depthWrite = false;
        if (material.map && material.map.magFilter !== NEAREST) {
          material.map.magFilter = NEAREST;
          material.map.needsUpdate = true;
        }
        compare.cut(mesh, spans[order < planes.length ? 0 : 1]);
      }),
    );
    compare.draw();
    band.draw();
    sketch.draw();
    marks.draw();
    tellView();
  }

  let viewed = "", viewTimer = null;

  /** Tell which part of the picture is on screen, "row0,row1,column0,column1,device pixels per pixel".
   *
   * In 3D it is all of it. */
  function tellView() {
    const solid = camera.isOrbiting();
    const { scale, left, top } = solid ? { scale: camera.fitScale(), left: 0, top: 0 } : camera.similarity();
    const part = (start, length, count) => [
      Math.max(0, Math.min(count, Math.floor(-start / scale))),
      Math.max(0, Math.min(count, solid ? count : Math.ceil((length - start) / scale))),
    ];
    const [r, c] = [part(top, canvas.clientHeight, rows), part(left, camera.half() || canvas.clientWidth, columns)];
    const view = [...r, ...c, (scale * window.devicePixelRatio).toFixed(3)].join(",");
    if (view === viewed) return;
    viewed = view;
    clearTimeout(viewTimer);
    viewTimer = setTimeout(() => send(viewId, viewed), VIEW_MS); // once it rests
  }

  // --- settings of the page ---

  // The panel's scroll bar lies over the right end of its boxes and buttons. Boxes of sliders have no
  // room for four decimals. Tooltips lie over the row above, which may be the next one to click, and
  // take its clicks: where the picture is wide enough, they go beside the panel instead. In a window
  // of 4K without scaling, viser's letters are tiny. Tabs take two rows, not three: what is used
  // together is then seen together in a window of 1280 x 720.
  const style = document.head.appendChild(document.createElement("style"));
  style.textContent = `
    .mantine-ScrollArea-content .mantine-ScrollArea-content{padding-right:6px}
    .mantine-Slider-root + .mantine-NumberInput-root{width:3.9rem!important}
    [role=tab][data-dock-tab]{padding:0 .5em!important}
    .mantine-Tooltip-tooltip{pointer-events:none;font-size:.85rem}
    .photolin-quiet .mantine-Tooltip-tooltip{visibility:hidden}
    @media (min-width:3000px) { html{font-size:17px!important} }
    @media (min-width:640px) {
      .mantine-Tooltip-tooltip[data-multiline]{
        left:calc(var(--photolin-canvas-width) - 15rem - 10px)!important}
      .mantine-Tooltip-tooltip[data-multiline] .mantine-Tooltip-arrow{display:none}
    }`;
  const measure = new ResizeObserver(() =>
    document.documentElement.style.setProperty("--photolin-canvas-width", `${canvas.clientWidth}px`));
  measure.observe(canvas);

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

  const fit = () => camera.placed() && camera.fit();

  // "Reset View" and changes of the world's orientation end here.
  Object.defineProperty(viewer, "resetCameraPose", {
    configurable: true,
    get: () => fit,
    set: () => {},
  });
  scene.onBeforeRender = beforeRender;
  viewer.requestRender();

  function close() {
    closing.abort();
    band.setSampling(null);
    clearTimeout(viewTimer);
    measure.disconnect();
    layer.remove();
    style.remove();
    scene.onBeforeRender = () => {};
  }

  window.photolin = {
    fit,
    oneToOne: () => camera.placed() && camera.oneToOne(),
    similarity: () => (camera.placed() ? camera.similarity() : null),
    setOrbit: camera.setOrbit,
    setMarks: marks.setMarks,
    setLight: light.setLight,
    setSketch: sketch.setSketch,
    setComparison: compare.set,
    setReadout: marks.setReadout,
    setReach: widgets.setReach,
    setTitles: widgets.setTitles,
    setSampling: band.setSampling,
    setBoxes: band.setBoxes,
    copy: widgets.copy,
    close,
  };
};
