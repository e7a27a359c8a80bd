#!/usr/bin/env python3
"""Writes the tables of docs/performance.md beside other programs from results.json. Standard library only.

Usage: benchmarks/peers/page.py [--check]
  --check  write nothing; return 1 where the page does not match the results"""
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "docs/performance.md"
MARKS = ("<!-- peers: made by benchmarks/peers/page.py -->\n", "<!-- end of peers -->\n")
NAMES = {"pliant": "pliant", "newton": "Newton", "mujoco": "MuJoCo's flex", "calculix": "CalculiX", "torch_fem": "torch-fem"}
LAWS = {"stable_neo_hookean": "neo-Hookean (Smith 2018)", "stable_neo_hookean_log": "neo-Hookean (Smith 2018, with its logarithm)", "corotated": "corotated",
        "saint_venant_kirchhoff": "Saint Venant and Kirchhoff"}
TOLERANCE = {"bar": 1e-3, "torus": 1e-3}  # [m] rms over nodes and compared times
DURATION = {"bar": 0.5, "torus": 0.15}  # [s] simulated
EQUAL_TIME = 1.0  # seconds of processor a simulated second: real time


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def significant(value, digits=2):
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and abs(value) >= 1 else text


def millimetres(value):
    return significant(1e3 * value)


def cost(section, run):
    """Seconds of processor a simulated second."""
    return run["processor_s"] / DURATION[section]


def of_settings(run):
    sweeps = run["settings"].get("sweeps")
    return f"{1e3 * run['settings']['step']:g} ms" + (f", {sweeps} sweeps" if sweeps else "")


def motions(results, section):
    """(program, method, nodes, its runs) of what moved; a program that did not is told with its reason."""
    out = []
    for program, by_cores in results.get(section, {}).items():
        figures = by_cores["1"]
        if "reason" in figures:
            out.append((program, "", 0, [figures]))
            continue
        for method in dict.fromkeys(run["method"] for run in figures["runs"]):
            out.append((program, method, figures["nodes"], [run for run in figures["runs"] if run["method"] == method]))
    return out


def reached(section, runs):
    """The cheapest run within the tolerance, or nothing."""
    return min((run for run in runs if run.get("error_m", 1.0) <= TOLERANCE[section]), key=lambda run: run["processor_s"], default=None)


def to_tolerance(results, section):
    all_of_it = motions(results, section)
    own = next(reached(section, runs) for program, _, _, runs in all_of_it if program == "pliant")
    rows = []
    for program, method, nodes, runs in all_of_it:
        name = NAMES[program] + (f", {method}" if method else "")
        cheap = [run["error_m"] for run in runs if "error_m" in run and cost(section, run) <= EQUAL_TIME]
        at_equal_time = millimetres(min(cheap)) if cheap else "none is as fast"
        run = reached(section, runs)
        if run:
            step_s = run["processor_s"] / run["steps"]
            rows.append([name, of_settings(run), run["steps"], significant(1e3 * step_s), f"{nodes / step_s:,.0f}", significant(cost(section, run)),
                         significant(run["processor_s"] / own["processor_s"]), millimetres(run["error_m"]), at_equal_time])
        else:
            best = min((run["error_m"] for run in runs if "error_m" in run), default=None)
            why = f"not reached: {millimetres(best)} mm at the best" if best else runs[0]["reason"]
            rows.append([name, why, *[""] * 6, at_equal_time if best else ""])
    return table(["program", "step", "steps", "ms a step", "node-steps a second", "processor seconds a simulated second", "times pliant's", "error [mm]",
                  "best error in real time, a processor second a simulated second [mm]"], rows)


def curves(results, section):
    rows = []
    for program, method, nodes, runs in motions(results, section):
        for run in runs:
            name = NAMES[program] + (f", {method}" if method else "")
            if "reason" in run:
                rows.append([name, of_settings(run) if "settings" in run else "", "", "", "", run["reason"]])
            else:
                step_s = run["processor_s"] / run["steps"]
                rows.append([name, of_settings(run), run["steps"], significant(1e3 * step_s, 3), significant(cost(section, run), 3), millimetres(run["error_m"])])
    return table(["program", "step asked for", "steps taken", "ms a step", "processor seconds a simulated second", "error [mm]"], rows)


def at_rest(results):
    rows = []
    for program, by_cores in results.get("at rest", {}).items():
        if "reason" in by_cores["1"]:
            rows.append([NAMES[program], "", "", "", "", "", by_cores["1"]["reason"]])
            continue
        for k, run in enumerate(by_cores["1"]["runs"]):
            more = by_cores.get("2", {}).get("runs", [])
            increments = run["settings"].get("increments")
            how = f"{run['method']}, {increments} increment{'s' if increments > 1 else ''}" if increments else run["method"]
            if "reason" in run:
                rows.append([NAMES[program], how, "", "", "", "", run["reason"]])
                continue
            two = more[k] if k < len(more) and "processor_s" in more[k] else None
            rows.append([NAMES[program], how, f"{1e3 * run['processor_s']:.0f}", f"{1e3 * two['processor_s']:.0f}" if two else "", f"{1e3 * run['sag_m']:.3f}",
                         f"{1e3 * run['sag_of_reference_m']:.3f}", f"{run['error_m']:.0e}"])
    return table(["program", "law and load", "ms of processor, one core", "two cores", "sag [mm]", "sag of the law by Newton's method [mm]", "rms of nodes off it [m]"], rows)


def apart(results):
    """How far the laws' own motions are from pliant's: {(program, method): metres} of a body."""
    def of(body):
        return [(NAMES[program], run["method"], run["apart_m"]) for program, by_body in results.get("laws", {}).items() for run in by_body.get(body, {}).get("runs", [])]
    told = {body: ", ".join(f"{name}, {method} {millimetres(metres)} mm" for name, method, metres in of(body) if metres > 0) for body in ("bar", "torus")}
    return "; ".join(f"{body}: {words}" for body, words in told.items() if words)


def two_cores(results):
    rows = []
    for program, by_cores in results.get("bar", {}).items():
        for one, two in zip(by_cores["1"].get("runs", []), by_cores.get("2", {}).get("runs", [])):
            if "processor_s" in one and "processor_s" in two:
                rows.append(f"{NAMES[program]} at steps of {of_settings(one)}: {1e3 * one['processor_s'] / one['steps']:.0f} ms of processor a step on one core and "
                            f"{1e3 * two['processor_s'] / two['steps']:.0f} on two")
    return f" {'; '.join(rows)}." if rows else ""


def unmeasured(results):
    """Of methods that run.py knows, those without figures."""
    known = {("bar", "mujoco", "Euler"), ("torus", "mujoco", "discrete"), ("torus", "mujoco", "Euler")}
    missing = sorted(f"{NAMES[program]}, {method}, on the {body}" for body, program, method in known
                     if method not in {run["method"] for run in results.get(body, {}).get(program, {}).get("1", {}).get("runs", [])})
    return f"Not measured yet, though `run.py` does: {'; '.join(missing)}. " if missing else ""


def start_up(results):
    rows = []
    for program in NAMES:
        figures = next((results[section][program]["1"] for section in ("bar", "at rest") if "import_s" in results.get(section, {}).get(program, {}).get("1", {})), None)
        if not figures or "runs" not in figures:
            continue
        first = {run["method"]: run for run in results.get("first", {}).get(program, {}).get("1", {}).get("runs", [])}
        scenes = [run["start_s"] for run in figures["runs"] if "start_s" in run]
        compiled = "; ".join(f"{method}: {run['start_s'] + run['compile_s']:.0f} s" for method, run in first.items())
        rows.append([f"{NAMES[program]} {figures['version']}", f"{figures['import_s']:.2f}", significant(1e3 * sorted(scenes)[len(scenes) // 2]) if program != "calculix" else "in its time",
                     compiled or ("not measured" if program == "newton" else "none")])
    return table(["program and version", "s to import", "ms to make a scene of the mesh", "compilation, once a machine, then kept"], rows)


def peers(results):
    m = results["machine"]
    loads = [figures["load"] for section in ("at rest", "bar", "torus") for by_cores in results.get(section, {}).values() for figures in by_cores.values() if "load" in figures]
    nodes = {section: next(n for _, _, n, _ in motions(results, section) if n) for section in ("bar", "torus")}
    return f"""
    apt-get install calculix-ccx
    python3 benchmarks/peers/run.py build/release       # {", ".join(NAMES[p] for p in NAMES)}; figures into benchmarks/peers/results.json

One core, processor time of the steps alone, medians of up to three repetitions (what takes longer than 1.5 s once), one program after the other on
{m['processor']} ({m['cores']} cores, shared with other work: load {min(loads):.0f} to {max(loads):.0f}), {m['date']}. Every program has the same tetrahedra, made by pliant, and
no damping. Errors are rms over nodes and compared times. On the bar they are against the program's own law and masses, integrated in double precision by a scheme
that shares no code with any of them (`benchmarks/peers/reference.py`: explicit, steps of 0.05 ms, which leaves 0.0002 mm), so that they are those of time
integration and solver alone, not of the mesh. Laws differ: pliant has {LAWS['stable_neo_hookean']} or corotated elements with consistent masses; Newton's block descent the
first with lumped masses, its explicit solver {LAWS['stable_neo_hookean_log']}; MuJoCo {LAWS['saint_venant_kirchhoff']}, lumped; CalculiX the same, consistent. At much
shorter steps each comes to its own reference. The rms distances of the other references from pliant's are what law, masses and, for the torus, contact make: {apart(results)}.

The bar ({nodes['bar']} nodes), let go under gravity for {DURATION['bar']:g} s, to an error of {1e3 * TOLERANCE['bar']:g} mm of a swing of 0.35 m, by the cheapest setting that reaches it:

{to_tolerance(results, "bar")}
Errors of pliant's and CalculiX's steps fall by a factor of two to four where steps are halved, those of block descent, `discrete` and the explicit ones by two: these
have to be short. Explicit steps are cheap, and on this coarse, soft bar they may be as long as half a millisecond: they cost what pliant's do for the same error.
That limit falls with the elements' size and with the inverse square root of the modulus; an implicit step has none. Block descent needs the more sweeps the longer the
step is. CalculiX solves each step fully, by a direct solver. Newton's settings are those of its examples but for steps and sweeps.

All settings of the bar:

{curves(results, "bar")}
The torus ({nodes['torus']} nodes, {TORUS_WORDS}), to {1e3 * TOLERANCE['torus']:g} mm. Contacts differ (pliant's and Newton's penalties, MuJoCo's
critically damped constraint of 5 ms), so each is compared with itself at much shorter steps. pliant halves steps in which this undamped impact does not settle: it takes
more than it is asked for, and what it gave up is in its time; explicit steps, which the impact keeps short for all, are the fastest. Block descent's reference has 10
sweeps of 0.16 ms and is itself not at the end of its convergence.

{to_tolerance(results, "torus")}
All settings of the torus:

{curves(results, "torus")}
The bar at rest under gravity. pliant's equilibria are corotated; each is compared with its own law's, found by Newton's method in `reference.py`:

{at_rest(results)}
CalculiX's times are those of the whole program, deck and results with it. Two cores were shared with other work: threads of OpenMP that wait for one another there
spend processor time, and wall times say nothing, so what a second core would gain alone is not told.

Start-up, processor seconds:

{start_up(results)}
A simulation of pliant's, MuJoCo's and Newton's (Warp on a processor) runs in one thread; two cores were given to CalculiX and torch-fem.{two_cores(results)}

{unmeasured(results)}Left out: JAX-FEM (torch-fem stands for that kind), Newton's XPBD, whose elements follow another law, and SOFA and FEBio, which no package registry has.
"""


TORUS_WORDS = "E = 4 kPa, nu = 0.35, 100 kg/m^3, tilted by 20 degrees, 5 mm above a floor without friction at 1.5 m/s, 0.15 s"


def main():
    if not (HERE / "results.json").exists():
        sys.exit("benchmarks/peers/results.json: not there; run benchmarks/peers/run.py")
    text = PAGE.read_text()
    begin, end = (text.index(mark) for mark in MARKS)
    made = text[:begin] + MARKS[0] + peers(json.loads((HERE / "results.json").read_text())) + text[end:]
    if "--check" in sys.argv:
        sys.exit("docs/performance.md: other than the results; run benchmarks/peers/page.py" if made != text else 0)
    PAGE.write_text(made)


if __name__ == "__main__":
    main()
