// The camera. viser has none for pictures, so this works on the objects that its client exposes for
// its own browser tests (__viserMutable). The picture is a plane that the camera faces squarely: its
// image on screen is a similarity, described by {scale, left, top} in CSS pixels. In 3D the camera
// turns around it instead.

function openCamera({ viewer, rows, columns, planes, worldHeight }) {
  const NONE = 0, ROTATE = 1, TRUCK = 2, TOUCH_ROTATE = 64, TOUCH_TRUCK = 128, TOUCH_DOLLY_TRUCK = 4096; // camera-controls ACTION
  const MARGIN = 0.98, CLOSEST = 128; // CLOSEST: CSS pixels per image pixel
  const FLAT = { near: 1e-4, far: 1e4 };
  const SOLID = { near: 0.1, far: 1e3 }; // these decide how finely depths are told apart

  const { canvas, camera } = viewer;
  const worldPixel = worldHeight / rows;

  let size = null; // [width, height] of the canvas that the camera was placed for
  let fitted = null; // pose that fit() chose, to stay fitted when the window changes
  let halves = 1; // views beside each other, of the same part of the picture
  let panning = true; // a drag moves the picture, in 2D
  let orbiting = false; // the picture lies on the relief, and the camera turns around it

  const hasPicture = () => Boolean(viewer.nodeRefFromName[planes[0]] && viewer.cameraControl);
  const placed = () => size !== null && hasPicture();
  const focalLength = () => canvas.clientHeight / 2 / Math.tan((camera.fov * Math.PI) / 360);
  const distanceAt = (scale) => (focalLength() * worldPixel) / scale;
  const fitScale = (width = canvas.clientWidth / halves, height = canvas.clientHeight) =>
    MARGIN * Math.min(width / columns, height / rows);

  /** Width of the left one of two views, CSS pixels; 0 where there is one. */
  const half = () =>
    halves === 1 ? 0 : Math.round((canvas.clientWidth / 2) * devicePixelRatio) / devicePixelRatio;
  /** How far right of the middle of the view the camera looks, in the world. */
  const aside = (distance) =>
    halves === 1 ? 0 : ((canvas.clientWidth - half()) / 2) * (distance / focalLength());

  /** Axes of the picture in three.js coordinates: right, down, into the picture, and its centre. */
  function axes() {
    const m = viewer.nodeRefFromName[planes[0]].matrixWorld;
    const vectors = [0, 1, 2].map((i) => camera.position.clone().setFromMatrixColumn(m, i));
    return [...vectors, camera.position.clone().setFromMatrixPosition(m)];
  }

  /** Look squarely at `target` from `distance`, and in 2D forbid any rotation from there. */
  function place(target, distance) {
    const controls = viewer.cameraControl;
    const [, down, into] = axes();
    const position = target.clone().addScaledVector(into, -distance);
    freeAngles();
    controls.minDistance = distanceAt(Math.max(CLOSEST, 4 * fitScale()));
    viewer.configuredMaxOrbitDistance = controls.maxDistance = distanceAt(fitScale() / 8);
    camera.up.copy(down).negate();
    controls.updateCameraUp();
    controls.setPosition(position.x, position.y, position.z, false);
    controls.setTarget(target.x, target.y, target.z, false);
    if (!orbiting) {
      controls.minAzimuthAngle = controls.maxAzimuthAngle = controls.azimuthAngle;
      controls.minPolarAngle = controls.maxPolarAngle = controls.polarAngle;
    }
    controls.update(1e-3); // moves the camera now, not with the next frame
    size = [canvas.clientWidth, canvas.clientHeight];
    viewer.requestRender();
  }

  function freeAngles() {
    Object.assign(viewer.cameraControl, {
      minAzimuthAngle: -Infinity, maxAzimuthAngle: Infinity, minPolarAngle: 0, maxPolarAngle: Math.PI,
    });
  }

  function pose() {
    const controls = viewer.cameraControl;
    return { target: controls.getTarget(camera.position.clone()), distance: controls.distance };
  }

  function fit() {
    const [right, , , centre] = axes();
    const distance = distanceAt(fitScale());
    place(centre.addScaledVector(right, aside(distance)), distance);
    fitted = pose();
  }

  function isFitted() {
    const { target, distance } = pose();
    return (
      fitted && Math.abs(distance / fitted.distance - 1) < 1e-6 &&
      target.distanceTo(fitted.target) < 1e-6 * distance
    );
  }

  /** Show one view or two beside each other, of what is shown now. */
  function setHalves(count) {
    if (count === halves) return;
    if (!placed()) return void (halves = count);
    const whole = isFitted();
    const { target, distance } = pose();
    const before = aside(distance);
    halves = count;
    if (whole) fit();
    else place(target.addScaledVector(axes()[0], aside(distance) - before), distance);
  }

  /** One image pixel on one pixel of the device, around the present centre, edges on edges. */
  function oneToOne() {
    const [right, down, , centre] = axes();
    const { target: now, distance } = pose();
    const offset = now.addScaledVector(right, -aside(distance)).sub(centre).divideScalar(worldPixel);
    const close = distanceAt(1 / window.devicePixelRatio);
    const snap = (along, pixels, deviceSize) =>
      Math.round(along - (pixels - deviceSize) / 2) + (pixels - deviceSize) / 2;
    const x = snap(offset.dot(right) + aside(close) / worldPixel, columns, canvas.width);
    const y = snap(offset.dot(down), rows, canvas.height);
    const target = centre.addScaledVector(right, x * worldPixel).addScaledVector(down, y * worldPixel);
    place(target, close);
  }

  /** What the mouse and fingers do: move the picture, or turn it and move it. */
  function setActions() {
    const controls = viewer.cameraControl;
    controls.mouseButtons.left = orbiting ? ROTATE : panning ? TRUCK : NONE;
    controls.mouseButtons.right = controls.mouseButtons.middle = TRUCK;
    controls.touches.one = orbiting ? TOUCH_ROTATE : panning ? TOUCH_TRUCK : NONE;
    controls.touches.two = controls.touches.three = TOUCH_DOLLY_TRUCK;
    controls.dollyToCursor = !orbiting;
  }

  /** Whether drags with the left button, or one finger, move the picture while it is flat. */
  function setPanning(on) {
    if (on === panning) return;
    panning = on;
    if (placed()) setActions();
  }

  /** Turn around the picture, or face it squarely again; either begins with all of it in view. */
  function setOrbit(on) {
    if (on === orbiting) return;
    orbiting = on;
    if (placed()) configure();
  }

  function configure() {
    Object.assign(camera, { fov: 30, ...(orbiting ? SOLID : FLAT) });
    camera.updateProjectionMatrix();
    setActions();
    fit();
  }

  /** Keep the view when the window has changed; before each frame. */
  function follow() {
    if (size === null) return configure();
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === size[0] && height === size[1]) return;
    const { target, distance } = pose();
    if (orbiting) {
      // as much of the relief as before, from where it is looked at
      const before = fitScale(...size) / size[1];
      size = [width, height];
      viewer.configuredMaxOrbitDistance = viewer.cameraControl.maxDistance = distanceAt(fitScale() / 8);
      viewer.cameraControl.dollyTo((distance * before) / (fitScale() / height), false);
      viewer.requestRender();
      return;
    }
    if (isFitted()) fit();
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

  /** Where a point [column, row, height], in pixels, lies on screen: [x, y], CSS pixels. */
  function project([column, row, height]) {
    const [right, down, into, point] = axes();
    point.addScaledVector(right, (column - columns / 2) * worldPixel);
    point.addScaledVector(down, (row - rows / 2) * worldPixel);
    point.addScaledVector(into, -height * worldPixel).project(camera);
    return [
      ((point.x + 1) / 2) * canvas.clientWidth,
      ((1 - point.y) / 2) * canvas.clientHeight,
    ];
  }

  /** The eye as [column, row, height], in pixels. */
  function eye() {
    const [right, down, into, centre] = axes();
    const v = camera.position.clone().sub(centre).divideScalar(worldPixel);
    return [v.dot(right) + columns / 2, v.dot(down) + rows / 2, -v.dot(into)];
  }

  /** Direction [column, row, height], of length 1, from the eye through (x, y) on the canvas. */
  function direction(x, y) {
    const [right, down, into] = axes();
    const v = camera.position.clone();
    v.set((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight, 0.5);
    v.unproject(camera).sub(camera.position).normalize();
    return [v.dot(right), v.dot(down), -v.dot(into)];
  }

  return {
    hasPicture, placed, fit, oneToOne, setPanning, setOrbit, follow, fitScale, similarity, project, eye, direction,
    setHalves, half,
    isOrbiting: () => orbiting,
  };
}
