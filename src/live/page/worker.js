// Runs the object. Messages in: commands by name; out: what is to be drawn, as fast as the page takes it.
let wasm, memory, running = false, speed = 1, field = 0, owed = 0, last = 0, timer = 0, stopped = "", recorded = null;
let cost = 0, sleeping = false, wants = true;

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

function report() {
  const message = { kind: "state", positions: floats(wasm.surface(), 3 * wasm.vertex_count()), time: wasm.time(), running, stopped,
                    cost, step: wasm.step_length(), energy: wasm.kinetic_energy(), probe: wasm.probe_force() };
  const hand = wasm.hand();
  if (hand) message.hand = Array.from(new Float64Array(memory.buffer, hand, 9));
  if (field) message.field = floats(wasm.field(field), wasm.vertex_count());
  const drops = wasm.drop_count();
  if (drops) message.drops = floats(wasm.drops(), 3 * drops);
  const arrays = [message.positions.buffer];
  if (message.field) arrays.push(message.field.buffer);
  wants = false;
  postMessage(message, arrays);
}

// At most 12 ms of work at once; what cannot be caught up with is given up, and the page says how slow it is.
function tick() {
  const now = performance.now(), since = Math.min(now - last, 50);
  last = now;
  if (running && !stopped) {
    const dt = wasm.step_length();
    owed = Math.min(owed + speed * since / 1e3, 6 * dt + 0.05 * speed);
    const begin = performance.now();
    let steps = 0;
    while (owed >= dt && performance.now() - begin < 14) {
      if (!wasm.step()) { stopped = "the motion cannot be resolved: nodes leap by several elements within a step"; break; }
      owed -= dt;
      ++steps;
    }
    if (steps) cost += 0.1 * ((performance.now() - begin) / steps - cost);
    if (owed >= dt) owed = dt;
  }
  if (wants) report();
}

const commands = {
  async load({ module, data }) {
    const compiled = await WebAssembly.compile(module);
    const instance = await WebAssembly.instantiate(compiled, stub(compiled));
    wasm = instance.exports;
    memory = wasm.memory;
    wasm._initialize?.();
    const bytes = new Uint8Array(data);
    const at = wasm.reserve(bytes.length);
    new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
    const nodes = wasm.load();
    postMessage({ kind: "loaded", nodes, elements: wasm.element_count(), vertices: wasm.vertex_count(),
                  triangles: new Int32Array(memory.buffer, wasm.triangles(), 3 * wasm.triangle_count()).slice(), step: wasm.step_length() });
    last = performance.now();
    report();
    timer = setInterval(tick, 4);
  },
  run({ on }) { running = on; stopped = on ? "" : stopped; owed = 0; },
  speed({ value }) { speed = value; },
  // For one who looks closely, and for tests.
  steps({ count }) {
    for (let i = 0; i < count && !stopped; ++i)
      if (!wasm.step()) stopped = "the motion cannot be resolved";
    report();
    postMessage({ kind: "stepped", nodes: Array.from(new Float64Array(memory.buffer, wasm.nodes(), 30)), time: wasm.time() });
  },
  field({ value }) { field = value; report(); },
  reset() { stopped = ""; owed = 0; wasm.reset(); report(); },
  recorded({ times }) {
    stopped = "";
    wasm.start_as_recorded();
    const frames = [], step = wasm.step_length();
    for (const t of times) {
      while (wasm.time() < t - times[0] - 0.5 * step && wasm.step());
      frames.push(floats(wasm.surface(), 3 * wasm.vertex_count()));
    }
    wasm.start_as_recorded();
    postMessage({ kind: "recorded", frames });
    report();
  },
  start() { stopped = ""; wasm.start_as_recorded(); report(); },
  grab({ triangle, corners, radius, stiffness }) { wasm.grab(triangle, ...corners, radius, stiffness ?? 0); },
  move({ to }) { wasm.move_hand(...to); },
  release() { wasm.let_go(); },
  gravity({ value }) { wasm.set_gravity(...value); },
  wind({ value, gusts }) { wasm.set_wind(...value, gusts); },
  rain({ rate, diameter }) { wasm.set_rain(rate, diameter); },
  probe({ from, to, radius }) { wasm.set_probe(...from, ...to, radius); },
  material({ stiffness, damping }) { wasm.set_material(stiffness, damping); },
  push({ value }) { wasm.push(...value); },
  sample({ value }) { wasm.set_sample(value); },
  shown() { wants = true; },
};
onmessage = async ({ data }) => {
  try {
    await commands[data.name](data);
  } catch (error) {
    stopped = String(error.message ?? error);
    clearInterval(timer);
    postMessage({ kind: "broken", text: stopped });
  }
};
