// Shapes as triangles with normals and edges. Creases are always drawn; smooth edges are drawn only on the outline.
"use strict";

const CREASE = Math.cos(40 * Math.PI / 180), LEVEL = 0.99999;
const EDGE = 6, SMOOTH = 12; // numbers for an edge: two ends; for a smooth edge also the normals of both faces

function newell(spots) {
  let n = [0, 0, 0];
  for (let k = 1; k < spots.length - 1; k++) n = add(n, cross(add(spots[k], spots[0], -1), add(spots[k + 1], spots[0], -1)));
  return n;
}

// A number for each vertex. Vertices at the same place have the same number.
function merged(v) {
  const places = new Map(), ids = [];
  for (let i = 0; i < v.length; i += 3) {
    const key = v[i].toFixed(6) + "," + v[i + 1].toFixed(6) + "," + v[i + 2].toFixed(6);
    if (!places.has(key)) places.set(key, places.size);
    ids.push(places.get(key));
  }
  return ids;
}

// Arrays of a mesh {v, f}. surface: place and normal of each triangle's corners; creases, smooth: EDGE or SMOOTH numbers per edge.
function solid(mesh) {
  const v = mesh.v, ids = merged(v), spot = (i) => [v[3 * i], v[3 * i + 1], v[3 * i + 2]];
  const normals = mesh.f.map((face) => newell(face.map(spot))), units = normals.map(unit);
  const around = new Map(), sides = new Map();
  mesh.f.forEach((face, f) => face.forEach((i, k) => {
    const a = ids[i], j = face[(k + 1) % face.length], b = ids[j];
    if (!around.has(a)) around.set(a, []);
    around.get(a).push(f);
    if (a === b) return;
    const key = a < b ? a + "," + b : b + "," + a;
    if (!sides.has(key)) sides.set(key, { p: spot(i), q: spot(j), faces: [] });
    sides.get(key).faces.push(f);
  }));
  const surface = [], creases = [], smooth = [];
  mesh.f.forEach((face, f) => {
    const corner = face.map((i) => {
      let n = [0, 0, 0];
      for (const g of around.get(ids[i])) if (dot(units[f], units[g]) > CREASE) n = add(n, normals[g]);
      return [...spot(i), ...unit(n)];
    });
    for (let k = 1; k < face.length - 1; k++) surface.push(...corner[0], ...corner[k], ...corner[k + 1]);
  });
  for (const { p, q, faces } of sides.values()) {
    const n = units[faces[0]], o = faces.length === 2 ? units[faces[1]] : n, bend = faces.length === 2 ? dot(n, o) : -1;
    if (bend < CREASE) creases.push(...p, ...q); else if (bend < LEVEL) smooth.push(...p, ...q, ...n, ...o);
  }
  return { surface: new Float32Array(surface), creases: new Float32Array(creases), smooth: new Float32Array(smooth) };
}

// The smooth edges on the outline. At such an edge, only one of the two faces faces the eye. eye: (position, 1) or
// (direction, 0), in the shape's axes.
function rim(smooth, eye) {
  const out = [], [x, y, z, w] = eye;
  for (let i = 0; i < smooth.length; i += SMOOTH) {
    const a = x - w * smooth[i], b = y - w * smooth[i + 1], c = z - w * smooth[i + 2];
    const n = smooth[i + 6] * a + smooth[i + 7] * b + smooth[i + 8] * c, o = smooth[i + 9] * a + smooth[i + 10] * b + smooth[i + 11] * c;
    if ((n > 0) !== (o > 0)) for (let k = 0; k < EDGE; k++) out.push(smooth[i + k]);
  }
  return new Float32Array(out);
}

// A line through points, as edges.
function strip(points) {
  const out = [];
  for (let k = 0; k + 1 < points.length; k++) out.push(...points[k], ...points[k + 1]);
  return out;
}

// The mesh of a body of revolution about x. rings: (x, radius) of each.
function turnedShape(rings, n = 20) {
  const v = [], f = [];
  for (const [x, r] of rings) for (let k = 0; k < n; k++) v.push(x, r * Math.cos(2 * Math.PI * k / n), r * Math.sin(2 * Math.PI * k / n));
  for (let i = 0; i + 1 < rings.length; i++) {
    for (let k = 0; k < n; k++) f.push([i * n + k, i * n + (k + 1) % n, (i + 1) * n + (k + 1) % n, (i + 1) * n + k]);
  }
  return { v, f };
}

const SHAFT = turnedShape([[0, 0], [0, 1], [1, 1], [1, 0]]), HEAD = turnedShape([[0, 0], [0, 1], [1, 0]], 24);

// The mesh of a contact's patch on its pin. The origin is on the pin's axis. The axes are outward normal, across the pin, along the
// pin. The patch is an oval. The contact point is on the rim of the oval, or in its middle if the pin has no ends.
function patchOf(mark) {
  const rings = 6, n = 28, v = [], f = [], lift = 1.006 * mark.arm, wide = mark.wide;
  for (let i = 0; i <= rings; i++) {
    for (let k = 0; k < n; k++) {
      const r = i / rings, across = r * Math.cos(2 * Math.PI * k / n), along = mark.inward * wide / 2 + r * Math.sin(2 * Math.PI * k / n) * wide / 2;
      v.push(...patchSpot(mark, lift, across, along, r, 2 * Math.PI * k / n));
    }
  }
  for (let i = 0; i < rings; i++) {
    for (let k = 0; k < n; k++) {
      const a = i * n + k, b = i * n + (k + 1) % n;
      f.push(i ? [a, a + n, b + n, b] : [a, a + n, b + n]);
    }
  }
  return { v, f };
}

function patchSpot({ shape, tall }, arm, across, along, r, turnedBy) {
  if (shape === "sphere") {
    const p = 0.45 * r;
    return [arm * Math.cos(p), arm * Math.sin(p) * Math.cos(turnedBy), arm * Math.sin(p) * Math.sin(turnedBy)];
  }
  if (shape === "cylinder") return [arm * Math.cos(0.5 * across), arm * Math.sin(0.5 * across), along];
  return [arm, tall * across, along];
}
