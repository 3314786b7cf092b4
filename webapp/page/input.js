// Pointer and keys: which pixel is meant, and who gets a key, the picture or a widget.

function openInput({
  viewer, listen, rows, columns, camera, band, cards, hoverId, pickId, keyId, send, sender, peek, CLICK_PIXELS,
}) {
  const CAMERA_KEYS = /^(Key[WASDQE]|Arrow(Up|Down|Left|Right))$/;

  const STEPS = /^(Arrow.*|[[\]{}zxu])$/i; // keys that go on while they are held

  const { canvas } = viewer;
  const hover = sender(hoverId);

  let reports = 0;
  /** Send an event, numbered, because the same value again would be no change of the widget. */
  const report = (uuid, text) => text && send(uuid, `${++reports} ${text}`);

  /** The pixel under the middle of the device pixel that the pointer is on, "" beside the picture.
   *
   * In 3D the ray through there: "ray column,row,height,..." of the eye and a direction, pixels. */
  function pixelUnder(event) {
    if (!camera.placed()) return "";
    const box = canvas.getBoundingClientRect();
    const middle = 0.5 / window.devicePixelRatio;
    const [x, y] = [event.clientX - box.left + middle, event.clientY - box.top + middle];
    if (camera.isOrbiting()) {
      const numbers = [...camera.eye(), ...camera.direction(x, y)];
      return `ray ${numbers.map((n) => n.toFixed(6)).join(",")}`;
    }
    const { scale, left, top } = camera.similarity();
    const beyond = camera.half() > 0 && x >= camera.half(); // in the right one of two views
    const row = Math.floor((y - top) / scale);
    const column = Math.floor((x - (beyond ? camera.half() : 0) - left) / scale);
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

  const local = {
    f: camera.fit, g: camera.oneToOne, " ": () => peek(true),
    h: cards.toggleHint, "?": cards.toggleKeys,
  };

  /** Whether it is one of the system's or the browser's own; brackets may need AltGr, which some
   * systems tell as Ctrl and Alt. */
  const isChord = (event) =>
    (event.ctrlKey || event.metaKey || event.altKey) && !event.getModifierState("AltGraph");

  /** What a key says; on a keyboard without Latin letters, what it says on one of the US. */
  function latin(event) {
    const { key, code, shiftKey } = event;
    const letter = /^Key([A-Z])$/.exec(code)?.[1];
    const plain = key.charCodeAt(0) < 0x250; // Latin letters with all their marks
    if (plain || event.getModifierState("AltGraph")) return key; // AltGr types €, say, at E
    if (letter) return shiftKey ? letter : letter.toLowerCase();
    const signs = { BracketLeft: "[{", BracketRight: "]}", Slash: "/?" }[code];
    return signs?.[Number(shiftKey)] ?? key;
  }

  /** Ctrl-Z and its like as Z and Shift-Z; the browser would else undo in a box that was left. */
  function undoOf(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isBusy(event.target)) return null;
    const key = latin(event).toLowerCase();
    return key === "y" || (key === "z" && event.shiftKey) ? "Z" : key === "z" ? "z" : null;
  }

  function onKey(event) {
    const undo = undoOf(event);
    if (undo) {
      event.preventDefault();
      return report(keyId, undo);
    }
    if (isChord(event) || isForWidget(event)) return;
    if (event.key === "Escape" && cards.closeKeys()) return;
    const key = latin(event);
    const action = local[key.toLowerCase()];
    const reported = key.length === 1 || /^(Arrow.*|Escape)$/.test(key);
    if (!action && !reported) return;
    if (isList(event.target)) {
      event.stopPropagation(); // it would open again
      giveFocusBack();
    }
    if (!action) return event.repeat && !STEPS.test(key) ? undefined : report(keyId, key);
    event.preventDefault();
    if (!event.repeat && camera.placed()) action();
  }

  listen(canvas, "pointermove", (event) => hover(pixelUnder(event)));
  listen(canvas, "pointerleave", () => hover(""));
  listen(canvas, "pointerdown", (event) => {
    pressed = event.isPrimary && event.button === 0 ? event : null;
  });
  listen(canvas, "pointerup", release);
  listen(canvas, "dblclick", () => camera.placed() && !band.isSampling() && camera.fit());
  // After the widget has had the click; those made with the keyboard have no detail.
  listen(window, "click", ({ detail }) => detail > 0 && setTimeout(giveFocusBack), true);
  listen(window, "keydown", onKey, true);
  listen(window, "keyup", (event) => event.key === " " && peek(false), true);
  listen(window, "blur", () => peek(false));
  // viser moves its camera by listeners on `document`, even while a slider has the focus: stop the
  // keys one step below, after every widget has had them.
  listen(document.documentElement, "keydown", (event) => {
    if (CAMERA_KEYS.test(event.code)) event.stopPropagation();
  });
}
