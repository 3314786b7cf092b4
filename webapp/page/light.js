// The ball on which the light of a relit picture is dragged.

function openLight({ layer, listen, lightId, sender }) {
  const BALL = 110; // CSS pixels
  const RIM = 0.99; // of the radius: the farthest that a light goes

  const post = sender(lightId);
  const ball = layer.appendChild(document.createElement("div"));
  ball.className = "photolin-light";
  ball.title = "Drag: where the light comes from. Middle: from the camera; rim: from the side";
  ball.style.cssText =
    `width:${BALL}px;height:${BALL}px;box-sizing:border-box;border-radius:50%;` +
    "position:absolute;z-index:2;right:14px;bottom:44px;" + // above the line of text
    "pointer-events:auto;cursor:grab;touch-action:none;border:1px solid #fff8;" +
    "box-shadow:0 0 0 1px #0008";
  ball.hidden = true;
  const spot = ball.appendChild(document.createElement("div"));
  spot.style.cssText =
    "position:absolute;width:12px;height:12px;margin:-6px 0 0 -6px;border-radius:50%;" +
    "background:#ffd43b;border:1px solid #000;pointer-events:none";

  /** Show the ball with its spot at x right, y up, of a unit direction; null hides it. */
  function setLight(light) {
    ball.hidden = light === null;
    if (light !== null && !ball.matches(":active")) draw(...light);
  }

  function draw(x, y) {
    const [left, top] = [50 + 50 * x, 50 - 50 * y];
    spot.style.left = `${left}%`;
    spot.style.top = `${top}%`;
    ball.style.background = `radial-gradient(circle at ${left}% ${top}%, #e8e8e8, #333 75%)`;
  }

  function drag(event) {
    if (!(event.buttons & 1)) return;
    const box = ball.getBoundingClientRect();
    let x = (2 * (event.clientX - box.left)) / box.width - 1;
    let y = 1 - (2 * (event.clientY - box.top)) / box.height;
    const length = Math.hypot(x, y);
    if (length > RIM) [x, y] = [(RIM * x) / length, (RIM * y) / length];
    draw(x, y);
    post(`${x.toFixed(4)},${y.toFixed(4)}`);
  }

  for (const type of ["pointerdown", "pointermove"]) listen(ball, type, drag);
  listen(ball, "pointerdown", (event) => {
    event.stopPropagation(); // it would move the picture too
    ball.setPointerCapture(event.pointerId);
  });

  return { setLight };
}
