#!/usr/bin/env python3
"""Balls pushed into pig liver, meat and phantoms: a law from half of the probes, the other half and greater depths predicted.

Recordings are read where they lie; nothing of them is kept but figures and a picture, which needs matplotlib."""
import csv
import json
import math
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import common

SETS = {"pig_liver_20150826_region1": 4.00e-3, "pig_liver_20150826_v2_region1": 4.00e-3, "pig_liver_20150826_v2_region2": 4.00e-3,
        "meat0904_region4": 3.16e-3, "probingRAL2018_T1": 3.16e-3, "region_small_balls": 3.16e-3}  # radius of the ball [m]
# Assumed: a block of 40 x 40 x 20 mm that its ground holds, finer where it is touched.
BLOCK = {"half_edges": [0.0016, 0.0034, 0.0075, 0.02], "depth_edges": [0.0016, 0.0034, 0.0075, 0.02]}
# Of what is simulated as the truth.
FINER = {"half_edges": [0.001, 0.0022, 0.004, 0.0085, 0.02], "depth_edges": [0.001, 0.0024, 0.006, 0.02]}
POISSONS_RATIO = 0.45  # assumed
DEPTHS = 6             # of a curve, evenly up to the greatest
LEAST_FORCE = 0.1      # [N] at the end; probes below have met nothing
NEIGHBOURS = 4         # probes that a place's stiffness is taken from
IMAGE = common.ROOT / "docs/images/organ-probing.png"


def read_probes(name):
    """(place [m], [(depth [m], force [N])]) of each probe, less its first reading; and how many met nothing."""
    curves, places = {}, {}
    with open(common.shared_data() / f"organ-probing/{name}.csv", newline="") as file:
        for r in csv.DictReader(file):
            curves.setdefault(r["probe"], []).append((1e-3 * float(r["depth_mm"]), float(r["f_normal_N"])))
            places[r["probe"]] = tuple(1e-3 * float(r[f"contact_{c}_mm"]) for c in "xyz")
    greatest = common.median([c[-1][0] for c in curves.values()])
    good = []
    for probe, curve in curves.items():
        curve = [(d, f - curve[0][1]) for d, f in curve]
        if curve[-1][0] > 0.95 * greatest and curve[-1][1] > LEAST_FORCE:
            good.append((places[probe], curve))
    return good, len(curves) - len(good), greatest


def at(curve, depth):
    """Force at a depth, linear between the steps; beyond the last, its step's slope."""
    for (d0, f0), (d1, f1) in zip(curve, curve[1:]):
        if depth <= d1 or (d1, f1) == curve[-1]:
            return f0 + (f1 - f0) * (depth - d0) / (d1 - d0)


def ask(program, work, name, request):
    out = work / f"{name}.json"
    if not out.exists():
        path = work / f"{name}-request.json"
        path.write_text(json.dumps(request))
        answer = subprocess.run([program, f"request={path}"], check=True, stdout=subprocess.PIPE, text=True).stdout
        out.write_text(answer)
    return common.read(out)


def fit(program, work, name, radius, depths, forces, terms, others):
    return ask(program, work, name, {"task": "fit", "block": BLOCK, "radius": radius, "depths": depths, "forces": forces, "terms": terms, "poisson_ratio": POISSONS_RATIO, "others": others})


def rms(a, b):
    return math.sqrt(sum((x - y)**2 for x, y in zip(a, b)) / len(a))


def factor(measured, model):
    """How many times as stiff, by least squares."""
    return common.dot(measured, model) / common.dot(model, model)


def quartiles(values):
    ordered = sorted(values)
    return [ordered[int(q * (len(ordered) - 1))] for q in (0.25, 0.5, 0.75)]


def one_set(program, work, name, radius):
    probes, rejected, greatest = read_probes(name)
    depths = [greatest * (i + 1) / DEPTHS for i in range(DEPTHS)]
    half = DEPTHS // 2
    curves = [[at(c, d) for d in depths] for _, c in probes]
    places = [p for p, _ in probes]
    fitted, held_out = list(range(0, len(probes), 2)), list(range(1, len(probes), 2))
    middle = [common.median([curves[i][k] for i in fitted]) for k in range(DEPTHS)]
    other_middle = [common.median([curves[i][k] for i in held_out]) for k in range(DEPTHS)]
    result = {"probes": len(probes), "rejected": rejected, "radius": radius, "depth": greatest, "greatest_force": middle[-1], "laws": {}}
    drawn = {"depths": depths, "curves": curves, "middle": middle, "other": other_middle, "laws": {}}
    whole = [{"radius": radius, "depths": depths}]
    best = None
    for terms in (0, 1, 2):
        f = fit(program, work, f"{name}-{terms}", radius, depths, middle, terms, whole)
        shallow = fit(program, work, f"{name}-{terms}-shallow", radius, depths[:half], middle[:half], terms, whole)
        model = f["others"][0]["forces"]
        unknowns = 1 if terms == 0 else 2 * terms
        bic = DEPTHS * math.log(max(rms(model, middle) / middle[-1], 1e-6)**2) + unknowns * math.log(DEPTHS)
        law = {"parameters": f["parameters"], "theta": f["theta"], "bic": bic, "seconds": common.number(f["seconds"], 3), "evaluations": f["evaluations"], "hertz_modulus": f["hertz_modulus"],
               "error": rms(model, middle) / middle[-1], "of_held_out_median": rms(model, other_middle) / other_middle[-1],
               "shallow_error": rms(shallow["others"][0]["forces"][:half], middle[:half]) / middle[half - 1]}
        deep = shallow["others"][0]["forces"][half:]
        law["deep_error"] = rms(deep, middle[half:]) / middle[-1] if None not in deep else None
        law["deepest"] = deep[-1] / middle[-1] - 1 if deep[-1] is not None else None
        law.update(predict_probes(model, curves, places, fitted, held_out, half))
        result["laws"][terms] = law
        drawn["laws"][terms] = (model, shallow["others"][0]["forces"])
        print(name, terms, {k: round(v, 3) if isinstance(v, float) else v for k, v in law.items() if k not in ("map", "theta")}, flush=True)
        if best is None or bic < result["laws"][best]["bic"]:
            best = terms
    result["chosen"] = best
    return result, drawn


def predict_probes(model, curves, places, fitted, held_out, half):
    """Errors of held-out probes, rms over each one's greatest force: as the law has it; with the stiffness of the fitted
    probes around; and of the deeper half, with the probe's own stiffness by its shallow half."""
    stiffness = {i: factor(curves[i], model) for i in fitted}
    plain, mapped, own = [], [], []
    for i in held_out:
        seen, top = curves[i], max(curves[i])
        near = sorted((math.dist(places[i], places[j]), j) for j in fitted)[:NEIGHBOURS]
        weights = [1 / (d * d + 1e-12) for d, _ in near]
        s = math.exp(sum(w * math.log(max(stiffness[j], 1e-3)) for w, (_, j) in zip(weights, near)) / sum(weights))
        plain.append(rms(model, seen) / top)
        mapped.append(rms([s * m for m in model], seen) / top)
        s = factor(seen[:half], model[:half])
        own.append(rms([s * m for m in model[half:]], seen[half:]) / top)
    return {"stiffness": quartiles(stiffness.values()), "plain": quartiles(plain), "mapped": quartiles(mapped), "own": quartiles(own)}


def second_radius(program, work):
    """No data have two balls on one object. Simulated: another law on a finer mesh, fitted at 4 mm, predicted at 2 and 8."""
    truth = [1500.0, 3.0, 0.40, 600.0, -12.0, 0.40, 300.0, 18.0, 0.40]
    depths = [0.0005, 0.001, 0.0015, 0.002]
    made = ask(program, work, "truth", {"task": "predict", "block": FINER, "parameters": truth, "others": [{"radius": r, "depths": depths} for r in (0.004, 0.002, 0.008)]})
    first = made["others"][0]["forces"]
    rows = []
    for terms in (0, 1, 2):
        f = fit(program, work, f"second-{terms}", 0.004, depths, first, terms, [{"radius": r, "depths": depths} for r in (0.004, 0.002, 0.008)])
        errors = [rms(o["forces"], t["forces"]) / max(t["forces"]) for o, t in zip(f["others"], made["others"])]
        rows.append({"terms": terms, "fitted": errors[0], "smaller": errors[1], "larger": errors[2]})
        print(rows[-1], flush=True)
    return {"truth": truth, "nodes": made["nodes"], "rows": rows}


def draw(drawn):
    plt = common.pyplot()
    if not plt:
        return
    figure, panels = plt.subplots(2, 3, figsize=(15, 8.5))
    for panel, (name, d) in zip(panels.flat, drawn.items()):
        x = [1e3 * v for v in d["depths"]]
        for c in d["curves"][::max(1, len(d["curves"]) // 60)]:
            panel.plot(x, c, color="#ccc", lw=0.6)
        panel.plot(x, d["middle"], "o", color="#333", label="median, fitted half")
        panel.plot(x, d["other"], "x", color="#333", label="median, other half")
        for terms, colour in ((0, "#b5401f"), (1, "#1f5fa8"), (2, "#3a8a3a")):
            label = f"{terms} term{'s' * (terms > 1)}" if terms else "linear"
            whole, shallow = d["laws"][terms]
            panel.plot(x, whole, color=colour, label=label)
            panel.plot(x, [v if v is not None else float("nan") for v in shallow], "--", color=colour, label=f"{label}, from the shallow half")
        panel.set_title(name, fontsize=10)
        panel.set_ylim(0, 2.2 * d["middle"][-1])
    panels.flat[0].legend(fontsize=8)
    figure.supxlabel("depth [mm]", fontsize=10)
    figure.supylabel("force along the normal [N]", fontsize=10)
    figure.tight_layout()
    figure.savefig(IMAGE, dpi=80)


def main():
    arguments = common.arguments(__doc__.splitlines()[0])
    program = arguments.program.parent.parent / "experiments/pliant_probing"
    figures, drawn = {"poisson_ratio": POISSONS_RATIO, "sets": {}}, {}
    for name, radius in SETS.items():
        figures["sets"][name], drawn[name] = one_set(program, arguments.work, name, radius)
    figures["second_radius"] = second_radius(program, arguments.work)
    check = ask(program, arguments.work, "check", {"task": "check", "block": BLOCK, "radius": 0.004, "depths": [0.0005, 0.002], "forces": [0.05, 0.3], "terms": 2, "poisson_ratio": POISSONS_RATIO})
    figures["derivative_errors"], figures["nodes"] = check["derivative_errors"], check["nodes"]
    common.write_results(__file__, figures)
    draw(drawn)


if __name__ == "__main__":
    main()
