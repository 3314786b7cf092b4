// What viser's widgets leave out: typing beyond the ends of a slider, an end of texts, tooltips of
// buttons, tooltips that go once a widget is used, as one looks at the picture then, how long a slider
// is held, the clipboard.

function openWidgets({ listen, send, holdId, mostText }) {
  const reaches = new Map(); // id of a slider -> the most that may be typed into its box
  const titles = new Map(); // id of a button -> its tooltip

  /** A box left takes its number back to the end of the slider. The server moves that end for a
   * number that it accepts, but its answer may come later: then the box is not told. */
  function isBeforeAnswer({ target }) {
    const row = target.closest?.(".mantine-NumberInput-root")?.parentElement;
    const slider = row?.querySelector(".mantine-Slider-root");
    const end = Number(slider?.querySelector("[role=slider]")?.getAttribute("aria-valuemax"));
    const typed = Number(target.value);
    return typed > end && typed <= reaches.get(slider?.id);
  }

  // the server takes no longer text: what is typed beyond would be seen here, and kept nowhere
  listen(window, "focusin", ({ target }) => target.tagName === "TEXTAREA" && (target.maxLength = mostText));
  listen(window, "focusout", (event) => isBeforeAnswer(event) && event.stopPropagation(), true);
  // tabs make their buttons anew when they are opened
  listen(window, "pointerover", ({ target }) => {
    const button = target.closest?.("button[id]");
    const title = titles.get(button?.id);
    if (title) button.title = title;
  });

  const ROW = 24; // CSS pixels: the pointer is on another widget
  const quiet = document.documentElement.classList;
  let usedAt = null; // height of the pointer when a widget was used last

  function use(event) {
    usedAt = event.clientY ?? usedAt ?? 0;
    quiet.add("photolin-quiet");
  }

  listen(window, "pointerdown", use, true);
  listen(window, "keydown", use, true);
  listen(window, "pointermove", ({ clientY, buttons }) => {
    if (usedAt === null || buttons || Math.abs(clientY - usedAt) < ROW) return;
    usedAt = null;
    quiet.remove("photolin-quiet");
  }, true);

  let held = null; // the pointer that is down on a slider: wherever it rests, it may go on

  function hold(pointer) {
    if (pointer === held) return;
    held = pointer;
    send(holdId, held === null ? "" : "held");
  }

  const letGo = ({ pointerId }) => pointerId === held && hold(null);

  listen(window, "pointerdown", ({ target, button, isPrimary, pointerId }) => {
    if (isPrimary && button === 0 && target.closest?.(".mantine-Slider-root")) hold(pointerId);
  }, true);
  for (const end of ["pointerup", "pointercancel"]) listen(window, end, letGo, true);
  // what ends it may have gone elsewhere, to a menu of the system say
  listen(window, "pointermove", (event) => event.buttons === 0 && letGo(event), true);
  listen(window, "blur", ({ target }) => target === window && hold(null), true);

  /** Put text on the clipboard, after a click or a key. */
  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // forbidden; or not there, as in pages of other machines, which come without TLS
      const area = document.body.appendChild(document.createElement("textarea"));
      area.style.cssText = "position:fixed;top:0;opacity:0";
      area.value = text;
      area.select();
      document.execCommand("copy");
      area.remove();
    }
  }

  return {
    copy,
    setReach: (id, most) => reaches.set(id, most),
    setTitles: (pairs) => pairs.forEach(([id, title]) => titles.set(id, title)),
  };
}
