// Clicks on parts of the panel, and whether they are in view: clicks.py sends this file, then calls
// window.openClicks.
//
// viser's HTML runs no scripts and its content is replaced whole, so this listens to the whole page
// and looks for elements by their id each time; a name that is not there yet is no mistake.
"use strict";

window.openClicks = ({ fieldId }) => {
  window.photolinClicks?.close();

  const LOOK_MS = 300;
  const closing = new AbortController();
  const watched = new Map(); // name -> whether it was in view
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
  window.addEventListener("click", press, { capture: true, signal: closing.signal });

  window.photolinClicks = {
    watch: (name) => watched.set(name, false),
    close: () => {
      closing.abort();
      clearInterval(timer);
    },
  };
};
