// Runs the object. Messages in: commands by name; out: what is to be drawn, as fast as the page takes it.
let wasm, memory, running = false, speed = 1, field = 0, owed = 0, last = 0, timer = 0, stopped = "";
let watches_strain = false, cost = 0, pace = 1, exact = false, timed_steps = 0, wants = true, pressed = false, changed = true, hidden = false;

const stub = (module) => {
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module))
    (imports[from] ??= {})[name] = (...words) => {
      if (name === "random_get") crypto.getRandomValues(new Uint8Array(memory.buffer, words[0], words[1]));
      if (name === "proc_exit") throw new Error("the simulation ended itself");
      return 0;
    };
  return imports;
};
const floats = (at, count) => new Float32Array(memory.buffer, at, count).slice();
const doubles = (at, count) => Array.from(new Float64Array(memory.buffer, at, count));
const surface = () => floats(wasm.surface(), 3 * wasm.vertex_count());

function report() {
  const message = { kind: "state", positions: surface(), time: wasm.time(), running, stopped, cost, pace, step: wasm.step_length(),
                    energy: wasm.kinetic_energy(), probe: doubles(wasm.probe(), 6), settled: !!wasm.is_settled() };
  const hand = wasm.hand();
  if (hand) message.hand = doubles(hand, 9);
  if (watches_strain) message.strain = floats(wasm.field(3), wasm.vertex_count()).sort()[Math.floor(0.99 * wasm.vertex_count())];
  if (field) message.field = floats(wasm.field(field), wasm.vertex_count());
  const drops = wasm.drop_count();
  if (drops) message.drops = floats(wasm.drops(), 3 * drops);
  const arrays = [message.positions.buffer];
  if (message.field) arrays.push(message.field.buffer);
  wants = changed = false;
  postMessage(message, arrays);
}
const timed = (work) => {
  const begin = performance.now(), done = work(), took = performance.now() - begin;
  cost += (timed_steps++ ? 0.1 : 1) * (took - cost);
  return done;
};
function set_pace(factor) { pace = factor; timed_steps = 0; wasm.set_pace(pace); }
// Steps are twice as long where a second of them takes longer than a second; still longer ones would move it another way.
function keep_pace() {
  if (!exact && timed_steps > 20 && pace < 2 && cost > 0.75e3 * wasm.step_length() / speed) set_pace(2);
}

// At most 14 ms of work at once; what cannot be caught up with is given up, and the page says how slow it is.
function move() {
  const now = performance.now(), since = Math.min(now - last, 50);
  last = now;
  if (!running || stopped || hidden) return;
  const dt = wasm.step_length();
  owed = Math.min(owed + speed * since / 1e3, 6 * dt + 0.05 * speed);
  while (owed >= dt && performance.now() - now < 14) {
    if (!timed(() => wasm.step())) { stopped = "the motion cannot be resolved: nodes leap by several elements within a step"; break; }
    owed -= dt;
  }
  if (owed >= dt) owed = dt;
  changed = true;
  keep_pace();
}
// One equilibrium, where something was moved since the last.
function lead() {
  if (wasm.is_settled()) return;
  stopped = timed(() => wasm.step()) ? "" : "no equilibrium is found any further";
  changed = true;
}
function tick() {
  pressed ? lead() : move();
  if (wants && (changed || !pressed)) report();
}
const settle = () => { for (let i = 0; i < 200 && !wasm.is_settled(); ++i) if (!wasm.step()) break; };

// What a sample of the parameters makes of the recording: surfaces at the frames' times, or under one press.
function replay({ sample, times, press }) {
  wasm.set_sample(sample);
  const frames = [];
  if (pressed) {
    wasm.press_as_recorded(press);
    settle();
    frames[press] = surface();
  } else {
    const step = wasm.step_length();
    wasm.start_as_recorded();
    for (const t of times) {
      while (wasm.time() < t - times[0] - 0.5 * step && wasm.step());
      frames.push(surface());
    }
  }
  postMessage({ kind: "replayed", sample, frames });
}

const commands = {
  async load({ module, data, watched }) {
    const compiled = await WebAssembly.compile(module);
    const instance = await WebAssembly.instantiate(compiled, stub(compiled));
    wasm = instance.exports;
    memory = wasm.memory;
    wasm._initialize?.();
    const bytes = new Uint8Array(data);
    const at = wasm.reserve(bytes.length);
    new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
    const nodes = wasm.load();
    pressed = wasm.step_length() === 0;
    if (!watched) return;
    postMessage({ kind: "loaded", nodes, elements: wasm.element_count(), vertices: wasm.vertex_count(),
                  triangles: new Int32Array(memory.buffer, wasm.triangles(), 3 * wasm.triangle_count()).slice(), step: wasm.step_length() });
    last = performance.now();
    report();
    timer = setInterval(tick, 4);
  },
  run({ on }) { running = on; stopped = on ? "" : stopped; owed = 0; },
  // Nobody looks: time stands still until somebody does.
  hidden({ on }) { hidden = on; owed = 0; },
  speed({ value }) { speed = value; },
  // For one who looks closely, and for tests.
  exact({ on }) { exact = on; if (on) set_pace(1); },
  steps({ count }) {
    set_pace(1);
    for (let i = 0; i < count && !stopped; ++i)
      if (!wasm.step()) stopped = "the motion cannot be resolved";
    report();
    postMessage({ kind: "stepped", nodes: doubles(wasm.nodes(), 30), time: wasm.time() });
  },
  field({ value }) { field = value; report(); },
  strain() { watches_strain = true; },
  reset() { stopped = ""; owed = 0; wasm.reset(); report(); },
  replay,
  start() { stopped = ""; wasm.start_as_recorded(); report(); },
  press({ test }) { stopped = ""; wasm.press_as_recorded(test); changed = true; },
  grab({ triangle, corners, radius }) { wasm.grab(triangle, ...corners, radius); },
  move({ to }) { wasm.move_hand(...to); },
  release() { wasm.let_go(); changed = true; },
  touch({ kind, triangle, corners, radius, rod }) { wasm.touch(kind, triangle, ...corners, radius, ...rod); },
  lead({ way }) { wasm.move_probe(...way); },
  lift() { wasm.lift(); changed = true; },
  gravity({ value }) { wasm.set_gravity(...value); },
  wind({ value, gusts }) { wasm.set_wind(...value, gusts); },
  rain({ rate, diameter }) { wasm.set_rain(rate, diameter); },
  material({ stiffness, damping }) { wasm.set_material(stiffness, damping); },
  push({ value }) { wasm.push(...value); },
  sample({ value }) { wasm.set_sample(value); },
  shown() { wants = true; },
};
// One after the other: what is asked while the module is loaded waits for it.
let queue = Promise.resolve();
onmessage = ({ data }) => {
  queue = queue.then(() => commands[data.name](data)).catch((error) => {
    stopped = String(error.message ?? error);
    clearInterval(timer);
    postMessage({ kind: "broken", text: stopped });
  });
};
