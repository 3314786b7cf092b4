// The surface in 3D: viser's mesh, with the picture and the overlay laid on it as they are.

function openRelief({ viewer, rows, columns, planes, relief, worldHeight }) {
  const CELLS = 100_000; // about, of the map of heights

  const worldPixel = worldHeight / rows;
  const cell = Math.ceil(Math.sqrt((rows * columns) / CELLS)) + 1; // pixels; no less than a mesh step
  const across = Math.ceil(columns / cell), down = Math.ceil(rows / cell);

  const dressed = new WeakMap(); // geometry of a surface -> {meshes: [picture, overlay], heights}
  let heights = null; // of the surface that is there

  /** Meshes of the surface that come from viser; none without one. */
  function surfaces() {
    const found = [];
    viewer.nodeRefFromName[relief]?.traverse(
      (mesh) => mesh.isMesh && !mesh.userData.photolin && found.push(mesh),
    );
    return found;
  }

  function mapOf(plane) {
    let found = null;
    viewer.nodeRefFromName[plane]?.traverse((mesh) => {
      if (mesh.isMesh && mesh.material.map) found ??= mesh;
    });
    return found;
  }

  /** Lay the pictures on the surface, those that `shown(order)` says; before each frame.
   *
   * Whether there is a surface to lie on. */
  function draw(shown) {
    const maps = planes.map(mapOf);
    heights = null;
    if (!maps[0]) return false;
    for (const source of surfaces()) {
      if (!dressed.has(source.geometry)) dressed.set(source.geometry, dress(source, maps[0].material));
      source.material.visible = false;
      const { meshes, heights: own } = dressed.get(source.geometry);
      heights = own;
      meshes.forEach((mesh, order) => {
        const map = maps[order]?.material.map ?? null;
        if (mesh.material.map !== map) {
          mesh.material.map = map;
          mesh.material.needsUpdate = true;
        }
        mesh.visible = Boolean(map) && shown(order);
      });
    }
    return heights !== null;
  }

  /** Two meshes with the geometry of `source` that show pictures as they are, without light. */
  function dress(source, like) {
    const { geometry } = source;
    const at = geometry.attributes.position;
    const uv = new Float32Array(2 * at.count);
    const heights = new Float32Array(down * across).fill(NaN);
    for (let n = 0; n < at.count; n++) {
      const column = at.getX(n) / worldPixel + columns / 2;
      const row = at.getY(n) / worldPixel + rows / 2;
      uv[2 * n] = column / columns;
      uv[2 * n + 1] = 1 - row / rows;
      heights[Math.floor(row / cell) * across + Math.floor(column / cell)] = -at.getZ(n) / worldPixel;
    }
    geometry.setAttribute("uv", new at.constructor(uv, 2));
    const meshes = planes.map((_, order) => {
      const material = new like.constructor({ side: 2, toneMapped: false, transparent: order > 0 });
      const mesh = new source.constructor(geometry, material);
      mesh.userData.photolin = true;
      mesh.renderOrder = order;
      source.add(mesh);
      return mesh;
    });
    return { meshes, heights };
  }

  /** Whether the surface lies between one of its points and the eye, [column, row, height] each.
   *
   * Told from one height in each cell, hence only where it is passed by more than a cell. */
  function hides(point, eye) {
    if (heights === null) return false;
    const way = eye.map((v, axis) => v - point[axis]);
    const length = Math.hypot(...way);
    let side = 0; // of the surface, on which the way to the eye begins
    for (let t = 2 * cell; t < length; t += cell / 2) {
      const [column, row, height] = way.map((v, axis) => point[axis] + (v * t) / length);
      if (!(column >= 0 && column < columns && row >= 0 && row < rows)) return false;
      const gap = height - heights[Math.floor(row / cell) * across + Math.floor(column / cell)];
      if (!(Math.abs(gap) > cell)) continue;
      if (side && Math.sign(gap) !== side) return true;
      side = Math.sign(gap);
    }
    return false;
  }

  return { draw, hides };
}
