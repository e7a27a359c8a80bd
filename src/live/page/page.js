"use strict";
const $ = (id) => document.getElementById(id);
const facts = JSON.parse($("facts").textContent);
const canvas = $("canvas"), told = $("told");
const trouble = (text) => { $("trouble").textContent = text; $("trouble").style.display = text ? "block" : "none"; };

// Vectors and column-major matrices of 4 x 4.
const add = (a, b) => a.map((x, i) => x + b[i]), sub = (a, b) => a.map((x, i) => x - b[i]), mul = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], norm = (a) => Math.hypot(...a);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => mul(a, 1 / (norm(a) || 1));
const times = (a, b) => { const c = new Float32Array(16);
  for (let i = 0; i < 4; ++i) for (let j = 0; j < 4; ++j) for (let k = 0; k < 4; ++k) c[4 * j + i] += a[4 * k + i] * b[4 * j + k]; return c; };
const looking = (eye, at, up) => { const f = unit(sub(at, eye)), s = unit(cross(f, up)), u = cross(s, f);
  return new Float32Array([s[0], u[0], -f[0], 0, s[1], u[1], -f[1], 0, s[2], u[2], -f[2], 0, -dot(s, eye), -dot(u, eye), dot(f, eye), 1]); };
const perspective = (fov, ratio, near, far) => { const f = 1 / Math.tan(fov / 2);
  return new Float32Array([f / ratio, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]); };
const orthographic = (half, near, far) => new Float32Array([1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, 2 / (near - far), 0, 0, 0, (far + near) / (near - far), 1]);
const percent = (x) => (100 * x).toFixed(0) + " %";
const readable = (x, digits = 3) => { if (!isFinite(x)) return "–"; const a = Math.abs(x);
  return a === 0 ? "0" : a >= 1e6 ? (x / 1e6).toPrecision(digits) + " M" : a >= 1e3 ? (x / 1e3).toPrecision(digits) + " k" : a < 1e-3 ? (x * 1e6).toPrecision(digits) + " µ" : a < 0.1 ? (x * 1e3).toPrecision(digits) + " m" : x.toPrecision(digits); };

const BALL = 0, PUNCH = 1, CAPSULE = 2, GLUED = 3;
const up = unit(facts.up), size = facts.size, right0 = unit(Math.abs(up[0]) < 0.9 ? cross(up, [1, 0, 0]) : cross(up, [0, 0, 1]));
const front0 = cross(right0, up);
const view = { azimuth: 0.6, height: 0.35, distance: 2.6 * size, at: facts.middle.slice() };
const pressed = facts.pressed, frameCount = pressed ? facts.presses.length : facts.times.length > 1 ? facts.times.length : 0;
let object = null, state = null, range = [0, 1], recordAt = -1, curve = [], aside = 0;

// --- drawing -----------------------------------------------------------------------------------------------------------
const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
if (!gl) trouble("This browser has no WebGL 2: the object is simulated, but it cannot be drawn. A current Firefox, Chromium or Safari draws it.");
const SURFACE_VERTEX = `#version 300 es
layout(location=0) in vec3 position; layout(location=1) in vec3 normal; layout(location=2) in float value;
uniform mat4 camera, light; uniform vec3 offset; out vec3 at, n; out vec4 lit; out float v;
void main() { at = position + offset; n = normal; v = value; lit = light * vec4(at, 1.); gl_Position = camera * vec4(at, 1.); }`;
const SURFACE_FRAGMENT = `#version 300 es
precision highp float; precision highp sampler2DShadow; in vec3 at, n; in vec4 lit; in float v; out vec4 colour;
uniform vec3 eye, sun, up, tint; uniform int coloured, ground, taps; uniform float grid, size; uniform sampler2DShadow shadow;
vec3 viridis(float t) { t = clamp(t, 0., 1.);
  const vec3 a=vec3(.2777,.0054,.334), b=vec3(.1051,1.4046,1.3846), c=vec3(-.3309,.2148,.0951), d=vec3(-4.6342,-5.7991,-19.3324), e=vec3(6.2283,14.1799,56.6906), f=vec3(4.7764,-13.7451,-65.353), g=vec3(-5.4355,4.6459,26.3124);
  return a+t*(b+t*(c+t*(d+t*(e+t*(f+t*g))))); }
float sunlight() { if (taps < 0) return 1.; vec3 p = lit.xyz / lit.w * .5 + .5; if (any(lessThan(p, vec3(0.))) || any(greaterThan(p, vec3(1.)))) return 1.;
  float sum = 0.; for (int i = -taps; i <= taps; ++i) for (int j = -taps; j <= taps; ++j) sum += texture(shadow, vec3(p.xy + vec2(i, j) * 1.4 / 2048., p.z - .0025)); return sum / float((2 * taps + 1) * (2 * taps + 1)); }
void main() {
  vec3 N = normalize(n), E = normalize(eye - at); if (ground == 0 && dot(N, E) < 0.) N = -N;
  vec3 F = normalize(cross(dFdx(at), dFdy(at))); if (dot(F, N) < 0.) F = -F;
  N = normalize(mix(F, N, smoothstep(.8, .95, dot(F, N)))); // edges stay edges
  float s = sunlight();
  vec3 base = coloured == 1 ? viridis(v) : tint; float alpha = 1.;
  if (ground == 1) {
    vec3 r = abs(up.x) < .9 ? normalize(cross(up, vec3(1,0,0))) : normalize(cross(up, vec3(0,0,1))); vec3 f = cross(r, up);
    vec2 g = vec2(dot(at, r), dot(at, f)) / grid; vec2 w = fwidth(g);
    vec2 line = smoothstep(w * 1.5, vec2(0.), abs(fract(g - .5) - .5)); base = mix(vec3(.925,.94,.953), vec3(.8,.83,.855), max(line.x, line.y) * .8);
    colour = vec4(base * (.74 + .26 * s), smoothstep(7. * size, 2. * size, length(at - eye) - 2. * size)); return; }
  float sky = .5 + .5 * dot(N, up), key = max(dot(N, sun), 0.) * s, fill = max(dot(N, E), 0.);
  vec3 H = normalize(sun + E); float shine = pow(max(dot(N, H), 0.), 40.) * s * .18, rim = pow(1. - fill, 3.) * .12;
  colour = vec4(base * (.34 + .24 * sky + .52 * key + .10 * fill) + shine + rim, alpha); }`;
const POINT_VERTEX = `#version 300 es
layout(location=0) in vec3 position; uniform mat4 camera; uniform vec3 offset; uniform float width; void main() { gl_Position = camera * vec4(position + offset, 1.); gl_PointSize = width; }`;
const POINT_FRAGMENT = `#version 300 es
precision highp float; uniform vec3 tint; uniform int disc; out vec4 colour; void main() { if (disc == 1 && length(gl_PointCoord - .5) > .5) discard; colour = vec4(tint, 1.); }`;

let programs, buffers, shadowMap;
// What is drawn is made cheaper where pictures come too slowly: without soft edges of shadows, then without shadows and with coarser pixels.
let quality = 2, slowFor = 0;
function program(vertex, fragment) {
  const p = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const s = gl.createShader(kind); gl.shaderSource(s, source); gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    gl.attachShader(p, s);
  }
  gl.linkProgram(p);
  const at = {}; const n = gl.getProgramParameter(p, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < n; ++i) { const name = gl.getActiveUniform(p, i).name; at[name] = gl.getUniformLocation(p, name); }
  return { p, at };
}
function prepare() {
  programs = { surface: program(SURFACE_VERTEX, SURFACE_FRAGMENT), points: program(POINT_VERTEX, POINT_FRAGMENT) };
  buffers = {};
  for (const name of ["position", "normal", "value", "index", "ground", "points", "probe", "probeNormal", "probeIndex", "quad"]) buffers[name] = gl.createBuffer();
  const texture = gl.createTexture(); gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.DEPTH_COMPONENT24, 2048, 2048, 0, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
  for (const [k, v] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, k, v);
  const frame = gl.createFramebuffer(); gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
  gl.drawBuffers([gl.NONE]); gl.readBuffer(gl.NONE); gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  shadowMap = { texture, frame };
}
/// A probe where it touches: the surface of revolution of a profile (height along the axis, distance from it, and the normal's two parts),
/// a ball or a rod with round ends, or a short cylinder whose end touches. What it is made of, for one who draws triangles.
function probeMesh(kind, at, inward, radius, rod) {
  const profile = [], n = 24;
  const along = kind === CAPSULE ? unit(rod) : inward, half = kind === CAPSULE ? 0.5 * norm(rod) : 0;
  const middle = kind === BALL || kind === CAPSULE ? sub(at, mul(inward, radius)) : at;
  if (kind === BALL || kind === CAPSULE) for (let i = 0; i <= 2 * n; ++i) { const a = Math.PI * (i / (2 * n) - 0.5), y = Math.sin(a); profile.push([radius * y + (y < 0 ? -half : half), radius * Math.cos(a), y, Math.cos(a)]); }
  else profile.push([0, 0, 1, 0], [0, radius, 1, 0], [0, radius, 0, 1], [-0.5 * radius, radius, 0, 1], [-0.5 * radius, radius, -1, 0], [-0.5 * radius, 0, -1, 0]);
  const e1 = unit(Math.abs(along[0]) < 0.9 ? cross(along, [1, 0, 0]) : cross(along, [0, 0, 1])), e2 = cross(along, e1), v = [], ns = [], index = [];
  profile.forEach(([y, r, ny, nr], i) => { for (let j = 0; j <= 2 * n; ++j) {
    const b = Math.PI * j / n, out = add(mul(e1, Math.cos(b)), mul(e2, Math.sin(b)));
    v.push(...add(middle, add(mul(along, y), mul(out, r)))); ns.push(...add(mul(along, ny), mul(out, nr)));
    if (i && j) { const k = i * (2 * n + 1) + j, l = k - 2 * n - 1; index.push(l - 1, k - 1, k, l - 1, k, l); } } });
  return { v: new Float32Array(v), n: new Float32Array(ns), index: new Uint32Array(index) };
}
function fill(buffer, data) { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); }
function attribute(place, buffer, components) { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, components, gl.FLOAT, false, 0, 0); }
function normals(positions, triangles) {
  const n = new Float32Array(positions.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const k of [a, b, c]) { n[k] += x; n[k + 1] += y; n[k + 2] += z; }
  }
  return n;
}
/// To the right of the picture, level.
let sidewards = right0;
const viewRight = () => unit(cross(sub(view.at, eye()), up));
function eye() {
  const c = Math.cos(view.height), s = Math.sin(view.height);
  const aside = add(mul(front0, Math.cos(view.azimuth) * c), mul(right0, Math.sin(view.azimuth) * c));
  return add(view.at, mul(add(aside, mul(up, s)), view.distance));
}
const FOV = 0.7;
function camera() { return times(perspective(FOV, canvas.width / canvas.height, 0.02 * size, 60 * size), looking(eye(), view.at, up)); }
function drawSurface(which, cam, light, positions, n, index, count, options) {
  const { p, at } = programs.surface;
  gl.useProgram(p);
  gl.uniformMatrix4fv(at.camera, false, cam); gl.uniformMatrix4fv(at.light, false, light);
  gl.uniform3fv(at.eye, eye()); gl.uniform3fv(at.sun, sun); gl.uniform3fv(at.up, up); gl.uniform3fv(at.tint, options.tint ?? [0.85, 0.55, 0.32]);
  gl.uniform3fv(at.offset, options.offset ?? [0, 0, 0]); gl.uniform1f(at.size, size); gl.uniform1f(at.grid, options.grid ?? 1);
  gl.uniform1i(at.coloured, options.values ? 1 : 0); gl.uniform1i(at.ground, options.ground ? 1 : 0); gl.uniform1i(at.taps, quality - 1); gl.uniform1i(at.shadow, 0);
  gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, which === "shadow" ? null : shadowMap.texture);
  attribute(0, positions, 3); attribute(1, n, 3);
  if (options.values) attribute(2, options.values, 1); else { gl.disableVertexAttribArray(2); gl.vertexAttrib1f(2, 0); }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index); gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
}
const sun = unit(add(add(mul(up, 1.5), mul(right0, 0.7)), mul(front0, 0.6)));
function planeQuad(plane) {
  const n = unit(plane.normal), a = unit(Math.abs(n[0]) < 0.9 ? cross(n, [1, 0, 0]) : cross(n, [0, 0, 1])), b = cross(n, a);
  const middle = sub(view.at, mul(n, dot(sub(view.at, plane.point), n)));
  const v = [], ns = [];
  for (const [s, t] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) { v.push(...add(middle, add(mul(a, 9 * size * s), mul(b, 9 * size * t)))); ns.push(...n); }
  return { v: new Float32Array(v), n: new Float32Array(ns) };
}
function points(list, cam, tint, width, mode = gl.POINTS, offset = [0, 0, 0]) {
  if (!list.length) return;
  const { p, at } = programs.points;
  gl.useProgram(p); gl.uniformMatrix4fv(at.camera, false, cam); gl.uniform3fv(at.offset, offset); gl.uniform3fv(at.tint, tint); gl.uniform1f(at.width, width * devicePixelRatio); gl.uniform1i(at.disc, mode === gl.POINTS ? 1 : 0);
  fill(buffers.points, list instanceof Float32Array ? list : new Float32Array(list)); attribute(0, buffers.points, 3); gl.disableVertexAttribArray(1); gl.disableVertexAttribArray(2);
  gl.drawArrays(mode, 0, list.length / 3);
}
let uploaded = null;
function draw() {
  requestAnimationFrame(draw);
  if (!object || !state) return;
  play();
  const copies = shownCopies();
  if (state !== uploaded) follow(copies[0].positions);
  if (!gl || gl.isContextLost()) { if (state !== uploaded) counted(); uploaded = state; worker.postMessage({ name: "shown" }); return; }
  const fineness = devicePixelRatio * (quality ? 1 : 0.6), w = Math.round(canvas.clientWidth * fineness), h = Math.round(canvas.clientHeight * fineness);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  let values = null;
  if (state.field && recordAt < 0) {
    const scaled = new Float32Array(state.field.length);
    for (let i = 0; i < scaled.length; ++i) scaled[i] = (state.field[i] - range[0]) / (range[1] - range[0] || 1);
    fill(buffers.value, scaled); values = buffers.value;
  }
  const light = times(orthographic((0.6 + copies.length) * size, -6 * size, 6 * size), looking(add(view.at, mul(sun, 0.01)), view.at, Math.abs(dot(sun, up)) > 0.99 ? right0 : up));
  const cam = camera(), count = object.triangles.length;
  gl.enable(gl.DEPTH_TEST); gl.disable(gl.BLEND);
  gl.bindFramebuffer(gl.FRAMEBUFFER, shadowMap.frame); gl.viewport(0, 0, 2048, 2048); gl.clear(gl.DEPTH_BUFFER_BIT);
  for (const { positions, offset } of copies) { upload(positions); if (quality) drawSurface("shadow", light, light, buffers.position, buffers.normal, buffers.index, count, { offset }); }
  gl.bindFramebuffer(gl.FRAMEBUFFER, null); gl.viewport(0, 0, w, h); gl.clearColor(0.933, 0.949, 0.961, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  for (const { positions, offset } of copies) { if (copies.length > 1) upload(positions); drawSurface("view", cam, light, buffers.position, buffers.normal, buffers.index, count, { values, offset }); }
  if (poke) {
    fill(buffers.probe, poke.mesh.v); fill(buffers.probeNormal, poke.mesh.n);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.probeIndex); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, poke.mesh.index, gl.STATIC_DRAW);
    drawSurface("view", cam, light, buffers.probe, buffers.probeNormal, buffers.probeIndex, poke.mesh.index.length, { tint: [0.25, 0.45, 0.65], offset: state.probe.slice(3) });
  }
  gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  for (const plane of facts.planes) {
    const quad = planeQuad(plane);
    fill(buffers.ground, quad.v); fill(buffers.points, quad.n);
    drawSurface("view", cam, light, buffers.ground, buffers.points, buffers.quad, 6, { ground: true, grid: facts.grid });
  }
  gl.disable(gl.BLEND);
  if (recordAt >= 0 && observed[recordAt]) for (const { offset } of copies) points(observed[recordAt], cam, [0.1, 0.35, 0.6], 3, gl.POINTS, offset);
  if (state.drops && recordAt < 0) points(state.drops, cam, [0.25, 0.5, 0.8], 3);
  if (state.hand && recordAt < 0) { points(state.hand.slice(3), cam, [0.75, 0.1, 0.3], 1, gl.LINES); points(state.hand.slice(3), cam, [0.75, 0.1, 0.3], 7); }
  if (state !== uploaded) { uploaded = state; counted(); worker.postMessage({ name: "shown" }); }
}
function upload(positions) { fill(buffers.position, positions); fill(buffers.normal, normals(positions, object.triangles)); }
/// Surfaces to be drawn, and how far from their place: the object, or what samples of its parameters make of the recording, side by side.
function shownCopies() {
  const there = (k) => replays.get(k)?.[recordAt];
  const samples = aside && recordAt >= 0 ? [...Array(aside).keys()].filter(there) : [-1];
  if (!samples.length || !there(samples[0])) return [{ positions: there(-1) ?? state.positions, offset: [0, 0, 0] }];
  return samples.map((k) => ({ positions: there(k), offset: mul(sidewards, aside ? 1.3 * size * (k - 0.5 * (aside - 1)) : 0) }));
}
/// The view follows what leaves it.
function follow(positions) {
  const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
  for (let i = 0; i < positions.length; i += 3) for (let k = 0; k < 3; ++k) { low[k] = Math.min(low[k], positions[i + k]); high[k] = Math.max(high[k], positions[i + k]); }
  const middle = mul(add(low, high), 0.5), away = sub(middle, view.at), far = norm(away);
  if (far > 0.5 * size && !aside) view.at = add(view.at, mul(away, 0.08 * (1 - 0.5 * size / far)));
}

// --- what is told --------------------------------------------------------------------------------------------------------
let warned = false, shownFrames = 0, since = performance.now(), rate = 0, simulated = 0, ratio = 0;
function counted() {
  ++shownFrames;
  const now = performance.now();
  if (now - since > 500) { rate = 1e3 * shownFrames / (now - since); slowFor = (pressed || !state.running) ? 0 : rate < 30 ? slowFor + 1 : 0;
    if (slowFor > 2 && quality) { --quality; slowFor = 0; }
    ratio = 1e3 * (state.time - simulated) / (now - since); simulated = state.time; shownFrames = 0; since = now; }
  let text = pressed ? `equilibria in <b>${readable(1e-3 * state.cost, 2)}s</b> · ${rate.toFixed(0)} pictures/s` : `<b>${state.time.toFixed(2)} s</b> · ${rate.toFixed(0)} pictures/s · `;
  if (!pressed) text += state.running && !state.stopped ? `${ratio.toFixed(2)} × real time` : "paused";
  if (!pressed && state.running && ratio < 0.8 * speedNow()) text += " (this object is too large for more)";
  if (!pressed && state.pace > 1) text += ` · steps ${state.pace} times the fit's`;
  if (state.hand) text += ` · pull <b>${readable(norm(state.hand.slice(0, 3)))}N</b>`;
  if (poke) text += ` · probe <b>${readable(norm(state.probe.slice(0, 3)))}N</b>, ${readable(dot(state.probe.slice(3), poke.inward))}m deep`;
  if (facts.strain && recordAt < 0 && state.strain > 1.05 * facts.strain) text += ` · strained by <b>${percent(state.strain)}</b>, fitted at up to ${percent(facts.strain)}: extrapolated`;
  if (recordAt >= 0) text += ` · ${aside ? `samples 1 to ${aside} of the parameters, left to right` : "the recording"}` + (pressed ? `, press ${recordAt + 1} of ${readable(facts.presses[recordAt])}N` : `, ${(facts.times[recordAt]).toFixed(2)} s`);
  told.innerHTML = text;
  if (state.stopped) trouble(pressed ? "Held back: " + state.stopped + ". Lift the probe or reset (R)." : "Stopped: " + state.stopped + ". Reset it (R), or make it softer, slower or less pulled.");
  else if (pressed && warned) trouble("");
  warned = !!state.stopped;
  if (state.field) bar();
  if (poke && curve.on) { curve.push([dot(state.probe.slice(3), poke.inward), dot(state.probe.slice(0, 3), poke.inward)]); plotCurve(); }
}
function bar() {
  const names = ["", "displacement [m]", "von Mises stress [Pa]", "greatest principal strain", "Young's modulus at rest [Pa]", "its standard deviation [Pa]", "Young's modulus at this strain [Pa]"];
  let low = Infinity, high = -Infinity;
  for (const v of state.field) { low = Math.min(low, v); high = Math.max(high, v); }
  const isModulus = fieldNow() === 4 || fieldNow() === 6;
  if (!isModulus) low = 0;
  range = [low, Math.max(high, range[1] * (fieldNow() === rangeOf && !isModulus ? 0.98 : 0), low + 1e-12)]; rangeOf = fieldNow();
  $("bar").style.display = "block"; $("bar-name").textContent = names[fieldNow()];
  $("bar-low").textContent = readable(range[0]); $("bar-high").textContent = readable(range[1]);
}
let rangeOf = 0;
function paintBar() {
  const c = $("bar").querySelector("canvas"), g = c.getContext("2d"), picture = g.createImageData(220, 1);
  const k = [[.2777, .0054, .334], [.1051, 1.4046, 1.3846], [-.3309, .2148, .0951], [-4.6342, -5.7991, -19.3324], [6.2283, 14.1799, 56.6906], [4.7764, -13.7451, -65.353], [-5.4355, 4.6459, 26.3124]];
  for (let i = 0; i < 220; ++i) for (let d = 0; d < 3; ++d) { const t = i / 219; picture.data[4 * i + d] = 255 * Math.min(1, Math.max(0, k.reduceRight((s, row) => s * t + row[d], 0))); picture.data[4 * i + 3] = 255; }
  g.putImageData(picture, 0, 0);
}
function plotCurve() {
  const c = $("curve"), g = c.getContext("2d"), ends = (k) => [Math.min(0, ...curve.map((p) => p[k])), Math.max(1e-12, ...curve.map((p) => p[k]))];
  const [d0, d1] = ends(0), [f0, f1] = ends(1), x = (d) => 60 + (c.width - 75) * (d - d0) / (d1 - d0), y = (f) => c.height - 40 - (c.height - 60) * (f - f0) / (f1 - f0);
  c.style.display = "block"; g.clearRect(0, 0, c.width, c.height);
  g.strokeStyle = "#d5dde3"; g.lineWidth = 2; g.beginPath(); g.moveTo(x(d0), y(0)); g.lineTo(x(d1), y(0)); g.moveTo(x(0), y(f0)); g.lineTo(x(0), y(f1)); g.stroke();
  g.strokeStyle = "#0b6fb0"; g.lineWidth = 3; g.beginPath();
  curve.forEach(([d, f], i) => g[i ? "lineTo" : "moveTo"](x(d), y(f)));
  g.stroke(); g.fillStyle = "#5c6b78"; g.font = "22px system-ui"; g.fillText(readable(f1) + "N", 4, 24); g.fillText(readable(d1) + "m", c.width - 110, c.height - 10);
  if (d0 < 0) g.fillText(readable(d0) + "m", 60, c.height - 10); else g.fillText("0", 40, c.height - 10);
  if (f0 < 0) g.fillText(readable(f0) + "N", 4, c.height - 44);
}

// --- the object ------------------------------------------------------------------------------------------------------------
async function unpacked(id) {
  const bytes = Uint8Array.from(atob($(id).textContent.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
const script = URL.createObjectURL(new Blob([$("worker").textContent], { type: "text/javascript" }));
const worker = new Worker(script);
const tell = (name, words = {}) => worker.postMessage({ name, ...words });
worker.onmessage = ({ data }) => {
  if (data.kind === "state") { state = data; }
  if (data.kind === "loaded") {
    object = data;
    $("about").textContent = `${data.nodes} nodes, ${data.elements} elements` + (pressed ? ", equilibria" : `, steps of ${readable(data.step)}s`);
    if (gl) { prepare(); gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.index); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(data.triangles), gl.STATIC_DRAW);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.quad); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array([0, 1, 2, 0, 2, 3]), gl.STATIC_DRAW); }
    $("drop").hidden = pressed || !frameCount;
    if (facts.strain) tell("strain");
    requestAnimationFrame(draw);
    if (!pressed) { if (frameCount) tell("start"); run(true); }
    if (frameCount) { $("recording").hidden = false; $("frame").max = frameCount - 1; rehearse(); }
  }
  if (data.kind === "broken") trouble("The simulation cannot go on: " + data.text);
  window.pliantLive.last = data.kind === "stepped" ? data : window.pliantLive.last;
};
worker.onerror = (event) => trouble("The simulation cannot be started: " + event.message);
const observed = [];
if (facts.observed) {
  const all = new Float32Array(Uint8Array.from(atob(facts.observed.points), (c) => c.charCodeAt(0)).buffer);
  let at = 0;
  for (const count of facts.observed.counts) { observed.push(all.subarray(at, at + 3 * count)); at += 3 * count; }
}
let packed = null;
Promise.all([unpacked("module"), unpacked("data")]).then(([module, data]) => { packed = { module, data }; tell("load", { ...packed, watched: true }); })
  .catch((error) => trouble("This page is broken: its object cannot be unpacked (" + (error.message ?? error) + "). Make it again by pliant live."));

// What was recorded, as the estimate and samples of the parameters have it: simulated by a second worker, so that nothing waits for it.
const replays = new Map();
let rehearser = null;
function rehearse() {
  if (!rehearser) {
    rehearser = new Worker(script);
    rehearser.onmessage = ({ data }) => {
      if (data.kind === "broken") return trouble("The recording cannot be replayed: " + data.text);
      const known = replays.get(data.sample) ?? [];
      data.frames.forEach((positions, i) => known[i] = positions);
      replays.set(data.sample, known);
      waiting = null;
      ask();
    };
    rehearser.postMessage({ name: "load", ...packed });
  }
  ask();
}
/// The next that is wanted and not there, one at a time: what is looked at may have changed meanwhile.
let waiting = null;
function ask() {
  if (waiting || !rehearser) return;
  const frame = Math.max(0, recordAt), wanted = [-1, ...Array(aside).keys()];
  const sample = wanted.find((k) => !replays.get(k)?.[frame]);
  if (sample === undefined) return;
  waiting = { sample, frame };
  rehearser.postMessage({ name: "replay", sample, times: facts.times, press: frame });
}
let playing = null, paused = null;
/// Goes on to the frame that is due; presses change twice a second.
function play() {
  if (!playing || !replays.get(-1)?.[Math.max(0, recordAt)]) return;
  // What is not simulated yet is waited for.
  if (pressed && shownCopies().length < (aside || 1)) { playing += performance.now() - (paused ?? performance.now()); paused = performance.now(); return; }
  paused = null;
  const last = pressed ? frameCount / 2 : facts.times[frameCount - 1] + 0.3, t = speedNow() * (performance.now() - playing) / 1e3 % last;
  const due = pressed ? Math.floor(2 * t) : Math.max(0, facts.times.findLastIndex((x) => x <= t));
  $("frame").value = due; scrub(due);
}
function playback(on) { playing = on ? performance.now() : null; $("play").setAttribute("aria-pressed", on); $("play").textContent = on ? "stop" : "play"; if (on) { $("frame").value = 0; scrub(0); } }
let running = false;
function run(on) { running = on; $("run").setAttribute("aria-pressed", on); $("run").textContent = on ? "pause" : "run"; if (on) { playback(false); scrub(-1); } tell("run", { on }); }
function scrub(frame) { recordAt = frame; if (frame < 0) { $("frame").nextElementSibling.textContent = ""; return; }
  if (running) { run(false); recordAt = frame; }
  if (!poke) uploaded = null;
  ask();
  $("frame").nextElementSibling.textContent = pressed ? readable(facts.presses[frame]) + "N" : facts.times[frame].toFixed(2) + " s"; }
const speedNow = () => 2 ** +$("speed").value, fieldNow = () => +$("field").value;
function slider(id, show, change) { const input = $(id), said = input.nextElementSibling; const apply = () => { said.textContent = show(+input.value); change(+input.value); }; input.oninput = apply; said.textContent = show(+input.value); return apply; }
slider("speed", (v) => "× " + (2 ** v).toPrecision(2), () => tell("speed", { value: speedNow() }));
const material = () => tell("material", { stiffness: 2 ** +$("stiffness").value, damping: 2 ** +$("damping").value });
slider("stiffness", (v) => "× " + (2 ** v).toPrecision(2), material);
slider("damping", (v) => "× " + (2 ** v).toPrecision(2), material);
function blow() { const a = +$("wind-from").value * Math.PI / 180, s = +$("wind").value; tell("wind", { value: mul(add(mul(front0, -Math.cos(a)), mul(right0, -Math.sin(a))), s), gusts: +$("gusts").value }); }
slider("wind", (v) => v.toFixed(1) + " m/s", blow); slider("wind-from", (v) => v + "°", blow); slider("gusts", (v) => (100 * v).toFixed(0) + " %", blow);
slider("rain", (v) => v ? readable(facts.rain * v * v) : "none", (v) => tell("rain", { rate: facts.rain * v * v, diameter: 0.004 }));
function weigh(direction) { const s = facts.gravity * +$("gravity").value, a = +$("turn").value * Math.PI / 180;
  tell("gravity", { value: mul(direction ?? add(mul(up, -Math.cos(a)), mul(right0, Math.sin(a))), s) }); }
slider("gravity", (v) => "× " + v.toFixed(2), () => weigh()); slider("turn", (v) => v + "°", () => weigh());
$("exact").onchange = () => tell("exact", { on: $("exact").checked });
$("field").onchange = () => { range = [0, 0]; $("bar").style.display = "none"; tell("field", { value: fieldNow() }); };
$("run").onclick = () => run(!running);
$("one").onclick = () => { run(false); scrub(-1); tell("steps", { count: 1 }); };
$("reset").onclick = () => { trouble(""); playback(false); scrub(-1); tell("reset"); };
$("drop").onclick = () => { trouble(""); scrub(-1); tell("start"); run(true); };
$("throw").onclick = () => tell("push", { value: add(mul(up, 1.6 * Math.sqrt(9.81 * size)), mul(right0, 0.5 * Math.sqrt(9.81 * size))) });
$("frame").oninput = () => { playback(false); scrub(+$("frame").value); };
$("play").onclick = () => playback(!playing);
$("aside").onchange = () => { aside = +$("aside").value; if (aside) { rehearse(); sidewards = viewRight(); view.distance = Math.max(view.distance, (1.6 + 0.9 * aside) * size); view.at = facts.middle.slice(); playback(true); } else view.distance = 2.6 * size; };
if (facts.samples && frameCount) $("aside-row").hidden = false;
for (const n of [2, 5]) if (n <= facts.samples) { const o = document.createElement("option"); o.value = n; o.textContent = n + " samples side by side"; $("aside").append(o); }
for (const row of pressed ? ["speed-row", "exact-row", "damping-row", "wind-row", "from-row", "gusts-row", "rain-row", "run", "one", "throw"] : []) $(row).hidden = true;
if (!facts.gravity) for (const row of ["gravity-row", "turn-row"]) $(row).hidden = true;
if (!facts.deviations) $("field").querySelector('[value="5"]').remove();
if (pressed) for (const key of document.querySelectorAll("#keys span")) key.hidden = true;
$("frame-name").textContent = pressed ? "press" : "frame";
for (let k = 0; k <= facts.samples && facts.samples; ++k) { $("sample-row").hidden = false; const o = document.createElement("option"); o.value = k - 1; o.textContent = k ? "sample " + k : "estimate"; $("sample").append(o); }
$("sample").onchange = () => tell("sample", { value: +$("sample").value });
if (window.DeviceOrientationEvent && navigator.maxTouchPoints > 0) {
  $("device").hidden = false;
  const turned = (e) => { const b = e.beta * Math.PI / 180, g = e.gamma * Math.PI / 180;
    weigh(unit(add(add(mul(up, -Math.sin(b) * Math.cos(g)), mul(right0, Math.sin(g))), mul(front0, Math.cos(b) * Math.cos(g))))); };
  $("device").onclick = async () => { const on = $("device").getAttribute("aria-pressed") !== "true"; $("device").setAttribute("aria-pressed", on);
    if (on && DeviceOrientationEvent.requestPermission) await DeviceOrientationEvent.requestPermission();
    window[on ? "addEventListener" : "removeEventListener"]("deviceorientation", turned); };
}

addEventListener("visibilitychange", () => { tell("hidden", { on: document.hidden }); since = performance.now(); shownFrames = 0; simulated = state?.time ?? 0; slowFor = 0; });

// --- hands -----------------------------------------------------------------------------------------------------------------
let poke = null, held = null, turning = null;
function ray(event) {
  const box = canvas.getBoundingClientRect(), x = 2 * (event.clientX - box.left) / box.width - 1, y = 1 - 2 * (event.clientY - box.top) / box.height;
  const from = eye(), f = unit(sub(view.at, from)), s = unit(cross(f, up)), u = cross(s, f), t = Math.tan(FOV / 2);
  return { from, along: unit(add(f, add(mul(s, x * t * box.width / box.height), mul(u, y * t)))), forward: f };
}
function hit({ from, along }) {
  const p = state.positions, t = object.triangles; let best = null;
  for (let i = 0; i < t.length; i += 3) {
    const a = 3 * t[i], b = 3 * t[i + 1], c = 3 * t[i + 2];
    const e1 = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]], e2 = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    const q = cross(along, e2), det = dot(e1, q); if (Math.abs(det) < 1e-18) continue;
    const o = sub(from, [p[a], p[a + 1], p[a + 2]]), u = dot(o, q) / det; if (u < 0 || u > 1) continue;
    const r = cross(o, e1), v = dot(along, r) / det; if (v < 0 || u + v > 1) continue;
    const s = dot(e2, r) / det; if (s > 0 && (!best || s < best.s)) best = { s, triangle: i / 3, corners: [1 - u - v, u, v], at: add(from, mul(along, s)), normal: unit(cross(e1, e2)) };
  }
  return best;
}
function place(r, s) { return add(r.from, mul(r.along, s / dot(r.along, r.forward))); }
canvas.onpointerdown = (event) => {
  if (!state) return;
  canvas.setPointerCapture(event.pointerId); canvas.focus();
  const r = ray(event), touched = event.button === 0 ? hit(r) : null;
  if (touched) { playback(false); scrub(-1); }
  if (touched && poking()) {
    const kind = +$("probe-kind").value, radius = +$("probe-size").value * size, outward = dot(touched.normal, r.along) > 0 ? mul(touched.normal, -1) : touched.normal;
    const sideways = unit(sub(cross(r.forward, up), mul(outward, dot(cross(r.forward, up), outward)))), rod = mul(sideways, 4 * radius), inward = mul(outward, -1);
    poke = { inward, sideways, from: [event.clientX, event.clientY], metres: 0.5 * norm(sub(touched.at, r.from)) * 2 * Math.tan(FOV / 2) / canvas.clientHeight,
             mesh: probeMesh(kind, touched.at, inward, radius, rod) };
    curve = []; curve.on = true; state.probe = [0, 0, 0, 0, 0, 0];
    if (!running && !pressed) run(true);
    tell("touch", { kind, triangle: touched.triangle, corners: touched.corners, radius, rod });
  } else if (touched) {
    held = { depth: dot(sub(touched.at, r.from), r.forward) };
    if (!running && !pressed) run(true);
    tell("grab", { triangle: touched.triangle, corners: touched.corners, radius: 0.08 * size });
    tell("move", { to: touched.at });
  } else { turning = [event.clientX, event.clientY]; }
};
canvas.onpointermove = (event) => {
  if (held) tell("move", { to: place(ray(event), held.depth) });
  else if (poke) tell("lead", { way: add(mul(poke.inward, (event.clientY - poke.from[1]) * poke.metres), mul(poke.sideways, (event.clientX - poke.from[0]) * poke.metres)) });
  else if (turning) { view.azimuth -= 0.008 * (event.clientX - turning[0]); view.height = Math.min(1.5, Math.max(-1.5, view.height + 0.008 * (event.clientY - turning[1]))); turning = [event.clientX, event.clientY]; }
};
canvas.onpointerup = canvas.onpointercancel = () => {
  if (held) tell("release");
  if (poke) { tell("lift"); curve.on = false; }
  held = poke = turning = null;
};
canvas.addEventListener("wheel", (event) => { event.preventDefault(); view.distance = Math.min(20 * size, Math.max(0.4 * size, view.distance * Math.exp(0.001 * event.deltaY))); }, { passive: false });
canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); trouble("The graphics were taken away; reload the page to draw again."); });
const poking = (on) => { if (on !== undefined) { $("poke").setAttribute("aria-pressed", on); $("poke").textContent = on ? "poking: drag down" : "poke"; } return $("poke").getAttribute("aria-pressed") === "true"; };
$("poke").onclick = () => poking(!poking());
poking(pressed);
addEventListener("keydown", (event) => {
  if (/INPUT|SELECT|BUTTON/.test(event.target.tagName) && event.key === " ") return;
  if (/INPUT|SELECT/.test(event.target.tagName)) return;
  const keys = { " ": () => run(!running), s: () => $("one").click(), r: () => $("reset").click(), t: () => $("throw").click(), p: () => $("poke").click(),
    ArrowLeft: () => view.azimuth -= 0.1, ArrowRight: () => view.azimuth += 0.1, ArrowUp: () => view.height = Math.min(1.5, view.height + 0.1), ArrowDown: () => view.height = Math.max(-1.5, view.height - 0.1) };
  const action = keys[event.key] ?? keys[event.key.toLowerCase()];
  if (action) { action(); event.preventDefault(); }
});
paintBar();
// For tests, and for those who look.
window.pliantLive = { tell, view, get state() { return state; }, get frames() { return replays.get(-1)?.[0] && replays.get(-1); }, replays, get copies() { return shownCopies().length; }, get curve() { return curve; }, project(p) {
  const c = camera(), q = [0, 1, 2, 3].map((i) => c[i] * p[0] + c[4 + i] * p[1] + c[8 + i] * p[2] + c[12 + i]), box = canvas.getBoundingClientRect();
  return [box.left + (q[0] / q[3] + 1) / 2 * box.width, box.top + (1 - q[1] / q[3]) / 2 * box.height]; }, get rate() { return rate; }, get quality() { return quality; }, get ratio() { return ratio; } };
