// WebGL 2: programs, buffers, and functions that draw a surface, lines, a dot, the ground and a cap.
"use strict";

const OFF = [0, 0, 0, 1];

// A program, with a function that sets its uniforms by name. Attributes have fixed locations.
function program(gl, vertex, fragment, attributes) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  attributes.forEach((name, place) => gl.bindAttribLocation(made, place, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  const set = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name, type } = gl.getActiveUniform(made, i), where = gl.getUniformLocation(made, name);
    const kinds = new Map([[gl.FLOAT, "1f"], [gl.FLOAT_VEC2, "2fv"], [gl.FLOAT_VEC3, "3fv"], [gl.FLOAT_VEC4, "4fv"]]);
    if (type === gl.FLOAT_MAT4) set[name] = (x) => gl.uniformMatrix4fv(where, false, x);
    else if (type === gl.FLOAT_MAT3) set[name] = (x) => gl.uniformMatrix3fv(where, false, x);
    else set[name] = (x) => gl["uniform" + kinds.get(type)](where, x);
  }
  return { made, put: (values) => { gl.useProgram(made); for (const k in values) if (set[k]) set[k](values[k]); } };
}

// Repeats each edge six times, for the corners of its two triangles. In software rendering, repetition is faster than instancing.
function corners(data) {
  const out = new Float32Array(6 * data.length);
  for (let i = 0; i < data.length; i += EDGE) for (let k = 0; k < 6; k++) out.set(data.subarray(i, i + EDGE), 6 * i + EDGE * k);
  return out;
}

function attributes(gl, data, places, stride, usage = gl.STATIC_DRAW) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, usage);
  for (const [place, size, offset] of places) {
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * stride, 4 * offset);
  }
  return buffer;
}

// The drawing functions; null without WebGL 2.
function graphics(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, stencil: true });
  if (!gl) return null;
  const programs = {
    surface: program(gl, SURFACE_VERTEX, SURFACE, ["p", "n"]),
    line: program(gl, LINE_VERTEX, PLAIN, ["a", "b"]),
    dot: program(gl, DOT_VERTEX, DOT, ["p"]),
    ground: program(gl, GROUND_VERTEX, GROUND_FRAGMENT, ["p"]),
    cap: program(gl, GROUND_VERTEX, CAP_FRAGMENT, ["p"]),
  };
  const owned = [];
  function array(fill) {
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    const buffer = fill();
    gl.bindVertexArray(null);
    owned.push({ vao, buffer });
    return { vao, buffer };
  }

  function lines(data, usage) {
    return { ...array(() => attributes(gl, corners(data), [[0, 3, 0], [1, 3, 3]], EDGE, usage)), count: data.length / EDGE };
  }

  // The buffers of a mesh {v, f}, and the smooth edges of the mesh. Each picture draws only the smooth edges on the outline.
  function shape(mesh) {
    const s = solid(mesh);
    return { ...array(() => attributes(gl, s.surface, [[0, 3, 0], [1, 3, 3]], 6)), count: s.surface.length / 6, creases: lines(s.creases), smooth: s.smooth };
  }

  const spot = array(() => attributes(gl, new Float32Array(3), [[0, 3, 0]], 3));
  const sheet = array(() => attributes(gl, new Float32Array([-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0]), [[0, 3, 0]], 3));

  owned.length = 0; // from here on, ``owned`` lists the buffers of the shapes of a run
  function draw(thing, name, values, call) {
    programs[name].put(values);
    gl.bindVertexArray(thing.vao);
    call();
  }

  return {
    gl, shape, lines,
    discard: () => { for (const { vao, buffer } of owned.splice(0)) { gl.deleteVertexArray(vao); gl.deleteBuffer(buffer); } },
    all: (values) => { for (const p of Object.values(programs)) p.put(values); },
    refill: (made, data) => { gl.bindBuffer(gl.ARRAY_BUFFER, made.buffer); gl.bufferData(gl.ARRAY_BUFFER, corners(data), gl.DYNAMIC_DRAW); made.count = data.length / EDGE; },
    surface: (s, values) => draw(s, "surface", values, () => gl.drawArrays(gl.TRIANGLES, 0, s.count)),
    edges: (l, values) => { if (l.count) draw(l, "line", values, () => gl.drawArrays(gl.TRIANGLES, 0, 6 * l.count)); },
    dot: (values) => draw(spot, "dot", values, () => gl.drawArrays(gl.POINTS, 0, 1)),
    ground: (values) => draw(sheet, "ground", values, () => gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)),
    cap: (values) => draw(sheet, "cap", values, () => gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)),
  };
}

// placed: the column-major 4×4 matrix that scales by factors k along the three axes, rotates by r (row-major 3×3), and moves to the
// place p. turning: the column-major 3×3 matrix of the rotation, for normals.
const placed = (r, p, k = [1, 1, 1]) => [
  k[0] * r[0], k[0] * r[3], k[0] * r[6], 0, k[1] * r[1], k[1] * r[4], k[1] * r[7], 0, k[2] * r[2], k[2] * r[5], k[2] * r[8], 0, ...p, 1,
];
const turning = (r) => [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]];
