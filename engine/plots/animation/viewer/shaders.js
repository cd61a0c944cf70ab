// Shaders: lit surfaces with a cutting plane, lines of constant width, dots, the ground, the cap of a cut.
"use strict";

const SURFACE_VERTEX = `#version 300 es
in vec3 p, n;
uniform mat4 uModel, uView;
uniform mat3 uTurn;
out vec3 vP, vN;
void main() {
  vec4 w = uModel * vec4(p, 1.0);
  vP = w.xyz;
  vN = uTurn * n;
  gl_Position = uView * w;
}`;

// Colour of a cut: flat and hatched.
const HATCHED = `
vec4 hatched(vec3 color, float wide) {
  float s = fract((gl_FragCoord.x + gl_FragCoord.y) / wide);
  return vec4(color * (0.62 + 0.16 * smoothstep(0.42, 0.5, s) * (1.0 - smoothstep(0.92, 1.0, s))), 1.0);
}
`;

// The back of a face is drawn like a cut. The back is visible only where an open surface is cut, because a closed surface gets a
// cap. A face of a see-through body (uGhost) is most transparent where it faces the viewer directly.
const SURFACE = `#version 300 es
precision highp float;
${HATCHED}in vec3 vP, vN;
uniform vec4 uColor, uEye, uCut;
uniform vec3 uLight, uUp;
uniform float uGhost, uHatch;
out vec4 o;
void main() {
  if (dot(vP, uCut.xyz) > uCut.w) discard;
  vec3 e = normalize(uEye.xyz - uEye.w * vP), n = normalize(vN);
  if (!gl_FrontFacing) { o = hatched(uColor.rgb, uHatch); return; }
  float lit = max(dot(n, uLight), 0.0), shine = pow(max(dot(reflect(-uLight, n), e), 0.0), 30.0);
  vec3 c = uColor.rgb * (0.64 + 0.10 * dot(n, uUp) + 0.34 * lit) + 0.08 * shine;
  float a = uColor.a * (uGhost > 0.0 ? mix(0.2, 0.85, pow(1.0 - abs(dot(n, e)), 2.5)) : 1.0);
  o = vec4(c * a, a);
}`;

const LINE_VERTEX = `#version 300 es
in vec3 a, b;
uniform mat4 uModel, uView;
uniform vec2 uHalf;
uniform float uWidth, uBias, uNear;
out vec3 vP;
void main() {
  int k = gl_VertexID % 6; // corners of two triangles: along the line 0 1 1 0 1 0, across the line - - + - + +
  vec2 corner = vec2(k == 1 || k == 2 || k == 4 ? 1.0 : 0.0, k == 2 || k == 4 || k == 5 ? 1.0 : -1.0);
  vec3 A = (uModel * vec4(a, 1.0)).xyz, B = (uModel * vec4(b, 1.0)).xyz;
  vec4 P = uView * vec4(A, 1.0), Q = uView * vec4(B, 1.0);
  if (P.w < uNear && Q.w < uNear) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (P.w < uNear) P = mix(P, Q, (uNear - P.w) / (Q.w - P.w));
  if (Q.w < uNear) Q = mix(Q, P, (uNear - Q.w) / (P.w - Q.w));
  vec2 d = Q.xy / Q.w * uHalf - P.xy / P.w * uHalf;
  d = length(d) > 1e-6 ? normalize(d) : vec2(1.0, 0.0);
  vec2 off = vec2(-d.y, d.x) * corner.y * uWidth * 0.5 + d * (corner.x - 0.5) * uWidth * 0.5;
  gl_Position = corner.x < 0.5 ? P : Q;
  gl_Position.xy += off / uHalf * gl_Position.w;
  gl_Position.z -= uBias * gl_Position.w;
  vP = corner.x < 0.5 ? A : B;
}`;

const PLAIN = `#version 300 es
precision highp float;
in vec3 vP;
uniform vec4 uColor, uCut;
out vec4 o;
void main() {
  if (dot(vP, uCut.xyz) > uCut.w) discard;
  o = vec4(uColor.rgb * uColor.a, uColor.a);
}`;

const DOT_VERTEX = `#version 300 es
in vec3 p;
uniform mat4 uView;
uniform vec3 uPlace;
uniform float uSize, uBias;
void main() {
  gl_Position = uView * vec4(p + uPlace, 1.0);
  gl_Position.z -= uBias * gl_Position.w;
  gl_PointSize = uSize;
}`;

const DOT = `#version 300 es
precision highp float;
uniform vec4 uColor;
uniform vec3 uRim;
uniform float uSize;
out vec4 o;
void main() {
  float r = length(gl_PointCoord - 0.5) * uSize, edge = 0.5 * uSize;
  float a = uColor.a * (1.0 - smoothstep(edge - 1.2, edge, r));
  if (a < 0.02) discard;
  o = vec4(mix(uColor.rgb, uRim, smoothstep(0.66 * edge, 0.74 * edge, r)) * a, a);
}`;

const GROUND_VERTEX = `#version 300 es
in vec3 p;
uniform mat4 uView;
uniform vec3 uFoot, uAlong, uAcross;
uniform float uReach;
out vec2 vQ, vFade;
void main() {
  vec3 w = uFoot + uReach * (p.x * uAlong + p.y * uAcross);
  vQ = vec2(dot(w, uAlong), dot(w, uAcross));
  vFade = p.xy;
  gl_Position = uView * vec4(w, 1.0);
}`;

const GROUND_FRAGMENT = `#version 300 es
precision highp float;
in vec2 vQ, vFade;
uniform vec4 uColor;
uniform float uStep, uShade;
out vec4 o;
float lines(vec2 q) {
  vec2 w = fwidth(q), d = abs(fract(q - 0.5) - 0.5) / max(w, 1e-6);
  vec2 l = (1.0 - smoothstep(0.4, 1.3, d)) * (1.0 - smoothstep(0.2, 0.6, w));
  return max(l.x, l.y);
}
void main() {
  float fade = 1.0 - smoothstep(0.25, 1.0, length(vFade));
  if (uShade > 0.0) { o = vec4(vec3(0.0), uShade * fade); return; }
  float a = uColor.a * fade * max(0.5 * lines(vQ / uStep), 0.85 * lines(vQ / (5.0 * uStep)));
  o = vec4(uColor.rgb * a, a);
}`;

const CAP_FRAGMENT = `#version 300 es
precision highp float;
${HATCHED}uniform vec4 uColor;
uniform float uHatch;
out vec4 o;
void main() { o = hatched(uColor.rgb, uHatch); }`;
