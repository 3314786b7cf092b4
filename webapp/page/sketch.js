// A sphere on the picture: its outline, what was clicked on its rim, numbered points on it.

function openSketch({ viewer, layer, camera }) {
  const SVG = "http://www.w3.org/2000/svg";
  const RIM = 5, POINT = 8; // CSS pixels, half the size of a mark

  const sketch = layer.appendChild(document.createElementNS(SVG, "svg"));
  sketch.style.cssText = "position:absolute;inset:0;width:100%;height:100%;overflow:hidden";
  sketch.setAttribute("class", "photolin-sketch");

  let shown = null; // {circle: [row, column, radius], guessed, rim: [[row, column]], points}
  let drawn = ""; // the view of the last drawing

  function add(name, attributes, text = "") {
    const element = sketch.appendChild(document.createElementNS(SVG, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
  }

  /** Light on dark, to be seen on any picture. */
  function addTwice(name, attributes) {
    add(name, { ...attributes, fill: "none", stroke: "#000", "stroke-width": 4 });
    add(name, { ...attributes, fill: "none", stroke: "#fff", "stroke-width": 2 });
  }

  /** Show what a sphere is known by; null: nothing. */
  function setSketch(value) {
    shown = value;
    drawn = "";
    viewer.requestRender();
  }

  /** Before each frame, as the picture may have moved; a surface in 3D has no outline. */
  function draw() {
    const flat = shown !== null && !camera.isOrbiting();
    const { scale, left, top } = camera.similarity();
    const view = flat ? [scale, left, top].join() : "none";
    if (view === drawn) return;
    drawn = view;
    sketch.replaceChildren();
    if (!flat) return;
    const place = ([row, column]) => [left + (column + 0.5) * scale, top + (row + 0.5) * scale];
    const [cx, cy] = place(shown.circle);
    const dashes = shown.guessed ? { "stroke-dasharray": "6 6" } : {};
    addTwice("circle", { cx, cy, r: shown.circle[2] * scale, ...dashes });
    for (const [x, y] of shown.rim.map(place)) {
      addTwice("path", { d: `M${x - RIM},${y}l${RIM},${-RIM}l${RIM},${RIM}l${-RIM},${RIM}z` });
    }
    for (const [n, [x, y]] of shown.points.map(place).entries()) {
      add("circle", { cx: x, cy: y, r: POINT, fill: "#fff", stroke: "#000", "stroke-width": 1.5 });
      const font = "font:700 11px system-ui;text-anchor:middle;dominant-baseline:central";
      add("text", { x, y, style: font, fill: "#000" }, `${n + 1}`);
    }
  }

  return { setSketch, draw };
}
