// Clicks and drags on parts of the panel, and whether they are in view: clicks.py sends this file, then calls
// window.openClicks.
//
// viser's HTML runs no scripts and its content is replaced whole, so this listens to the whole page
// and looks for elements by their id each time; a name that is not there yet is no mistake.
"use strict";

window.openClicks = ({ fieldId }) => {
  window.photolinClicks?.close();

  const LOOK_MS = 300;
  const DRAG_MS = 50;
  const closing = new AbortController();
  const watched = new Map(); // name -> whether it was in view
  const dragged = new Set(); // names of those that can be dragged
  let held = null; // { name, pointerId, box, x, y, at }: what is dragged, and what was told of it
  let reports = 0;

  /** Send an event, numbered, because the same value again would be no change of the widget. */
  const report = (text) =>
    window.__viserMutable.sendMessage({
      type: "GuiUpdateMessage",
      uuid: fieldId,
      updates: { value: `${++reports} ${text}` },
    });

  const find = (name) => document.getElementById(`photolin-${name}`);

  function press(event) {
    if (event.button !== 0 || !(event.target instanceof Element)) return;
    for (const name of watched.keys()) {
      const element = find(name);
      if (!element?.contains(event.target)) continue;
      const part = event.target.closest("[data-part]");
      if (part && element.contains(part)) return report(`${name} ${part.dataset.part}`);
      const box = element.getBoundingClientRect();
      const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
      if (x >= 0 && x < 1 && y >= 0 && y < 1) report(`${name} ${x.toFixed(4)},${y.toFixed(4)}`);
      return;
    }
  }

  function hold(event) {
    if (event.button !== 0 || !(event.target instanceof Element)) return;
    for (const name of dragged) {
      const element = find(name);
      if (!element?.contains(event.target)) continue;
      const { pointerId, clientX: x, clientY: y } = event;
      held = { name, pointerId, box: element.getBoundingClientRect(), x, y, at: 0 };
      return;
    }
  }

  /** Tell how far the pointer came since it was last told; rarely enough to be drawn each time. */
  function drag(event) {
    if (event.pointerId !== held?.pointerId) return;
    event.preventDefault();
    const over = event.type !== "pointermove" || event.buttons === 0; // let go outside the window
    if (!over && performance.now() - held.at < DRAG_MS) return;
    const limit = (share) => Math.min(Math.max(share, -1), 1).toFixed(4);
    const [x, y] = [event.clientX - held.x, event.clientY - held.y];
    if (x !== 0 || y !== 0)
      report(`${held.name} by ${limit(x / held.box.width)},${limit(y / held.box.height)}`);
    held = over ? null : { ...held, x: event.clientX, y: event.clientY, at: performance.now() };
  }

  /** Tabs and folders of viser tell nobody when they are opened. */
  function look() {
    for (const [name, before] of watched) {
      const now = find(name)?.checkVisibility() ?? false;
      if (now === before) continue;
      watched.set(name, now);
      report(`${name} ${now ? "shown" : "hidden"}`);
    }
  }

  const timer = setInterval(look, LOOK_MS);
  const listen = (type, action) =>
    window.addEventListener(type, action, { capture: true, signal: closing.signal });
  listen("click", press);
  listen("pointerdown", hold);
  for (const type of ["pointermove", "pointerup", "pointercancel"]) listen(type, drag);

  window.photolinClicks = {
    watch: (name) => watched.set(name, false),
    drag: (name) => dragged.add(name),
    close: () => {
      closing.abort();
      clearInterval(timer);
    },
  };
};
