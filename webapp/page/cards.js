// Cards over the picture: the hint for the first visit, and the list of keys. The picture around
// them stays in use; the hint lets all clicks through but those on its x.

function openCards({ layer, keys, hint }) {
  const DISMISSED = "photolin-hint-dismissed"; // in the browser's storage of this address
  const CARD =
    "color:var(--mantine-color-text);background:var(--mantine-color-body);opacity:.96;" +
    "border:1px solid var(--mantine-color-default-border);border-radius:6px;" +
    "box-shadow:0 2px 8px #0006;font:.88rem/1.45 system-ui,sans-serif;box-sizing:border-box;";
  const KEY =
    "white-space:nowrap;padding:0 .4em;border-radius:3px;font:600 .81rem/1.5 ui-monospace,monospace;" +
    "border:1px solid var(--mantine-color-default-border);justify-self:start;align-self:start";

  const add = (parent, tag, text, style, className = "") => {
    const element = parent.appendChild(document.createElement(tag));
    element.textContent = text;
    element.style.cssText = style;
    element.className = className;
    return element;
  };

  // above the line of text in the lower left corner, also where that takes two lines; viser's notes
  // come in the upper left one
  const pile = add(layer, "div", "",
    "position:absolute;z-index:1;inset:10px 10px 52px;display:flex;" +
    "flex-direction:column-reverse;align-items:center;gap:8px;pointer-events:none");

  function addClose(card, tip, close) {
    const button = add(card, "button", "×",
      "position:absolute;top:2px;right:2px;width:24px;height:24px;border:none;background:none;" +
      "color:inherit;font:18px/1 system-ui;cursor:pointer;pointer-events:auto;padding:0");
    button.title = tip;
    button.setAttribute("aria-label", tip);
    button.addEventListener("click", close);
  }

  // --- the hint ---

  const told = add(pile, "div", "",
    CARD + "position:relative;max-width:min(46em,100%);padding:.5em 2.4em .5em .9em;flex:none",
    "photolin-hint");
  for (const [n, [text, colour]] of hint.entries()) {
    const part = add(told, "span", "", "");
    if (colour) {
      const square = "display:inline-block;width:.75em;height:.75em;border-radius:2px;margin-right:.3em";
      part.style.whiteSpace = "nowrap";
      add(part, "span", "", `${square};background:${colour}`);
    }
    part.append(text);
    if (colour && hint[n + 1]?.[1]) told.append(", ");
  }
  addClose(told, "Hide this hint (key: H)", dismiss);

  // storage may be forbidden: then the hint comes with every visit

  function dismiss() {
    told.hidden = true;
    try {
      localStorage.setItem(DISMISSED, "yes");
    } catch {}
  }

  function isDismissed() {
    try {
      return localStorage.getItem(DISMISSED) !== null;
    } catch {
      return false;
    }
  }

  told.hidden = isDismissed();

  // --- the keys ---

  const list = add(pile, "div", "",
    CARD + "position:relative;min-height:0;max-width:min(56em,100%);overflow:auto;pointer-events:auto;" +
    "cursor:pointer;padding:.7em 2.4em .7em .9em", "photolin-keys");
  list.title = "A click closes this list";
  const columns = add(list, "div", "", "columns:2 20em;column-gap:2em");
  for (const [shown, does] of keys) {
    const row = add(columns, "div", "",
      "display:grid;grid-template-columns:7.4em 1fr;break-inside:avoid;padding:.15em 0");
    add(row, "span", shown, KEY);
    add(row, "span", does, "");
  }
  addClose(list, "Close (keys: ? and Esc)", () => {}); // the click closes anyway
  list.addEventListener("click", () => (list.hidden = true));
  list.hidden = true;

  return {
    toggleHint: () => (told.hidden ? (told.hidden = false) : dismiss()),
    toggleKeys: () => (list.hidden = !list.hidden),
    /** Close the list of keys; whether it was open. */
    closeKeys: () => !list.hidden && (list.hidden = true),
  };
}
