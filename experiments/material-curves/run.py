#!/usr/bin/env python3
"""Stress-strain curves of 13 silicones, of rubbers, a gel and brain tissue, and of a shoe's foam, by one cube each.

Every curve is read where it lies; nothing of it is kept but errors, parameters and pictures. Pictures are drawn where
matplotlib is installed; all else needs the standard library alone."""
import csv
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import common

INCOMPRESSIBLE = 0.4995  # Poisson's ratio of what keeps its volume: not estimated
POINTS = 60              # of a silicone's curve that a fit takes, evenly over the strain
SMALL = 0.5              # strain up to which a linear law is fitted, too
NOISE = 0.01             # deviation of a stress, of its curve's greatest
MPA = 1e6
UNITS = {"Budday": 1e3, "Katashima": 1e3}  # [Pa]; the others are in MPa
IMAGES = common.ROOT / "docs/images"


def fit(work, program, name, tests, fits):
    """Each fit's law and, test by test, stresses and error: `pliant fit` of a capture of these curves."""
    found = {}
    for number, f in enumerate(fits):
        folder = work / f"{name}-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        text = f'format = "capture/1"\nname = {json.dumps(name)}\n'
        for i, t in enumerate(tests):
            deviation = NOISE * max(map(abs, t["stress"]))
            columns = [t["stretch"], *([t["second"]] if "second" in t else []), t["stress"]]
            header = "stretch,second,stress,std" if "second" in t else "stretch,stress,std"
            rows = [",".join(map(repr, [*row, deviation])) for row in zip(*columns)]
            (folder / f"{i}.csv").write_text("\n".join([header, *rows, ""]))
            facts = {"name": f"{i} {t['name']}", "mode": t["mode"], "measure": t.get("measure", "first"), "curve": f"{i}.csv",
                     "role": "fit" if i in f["tests"] else "test", **({"prestretch": t["prestretch"]} if "prestretch" in t else {})}
            text += "[[material_curve]]\n" + "".join(f"{key} = {common.toml(value)}\n" for key, value in facts.items())
        (folder / "capture.toml").write_text(text)
        choices = {"material": f["law"]} if "law" in f else {}
        if f["poisson_ratio"] is not None:
            choices |= {"poissons_ratio": f["poisson_ratio"], "poissons_ratio.estimate": False}
        figures = common.fit(program, folder, folder / "fit", choices)
        result = figures["result"]
        curves = {int(c["name"].split()[0]): c for c in result["curves"]}
        found[f["name"]] = {"tests": f["tests"], "seconds": figures["wall_seconds"], "verdict": result["verdict"], "material": result["material"],
                            "parameters": {key: [p["value"], p.get("std")] for key, p in result["parameters"].items() if key != "poisson_ratio"},
                            "rms": [curves[i]["relative_rms"] for i in range(len(tests))], "stress": [curves[i]["predicted"] for i in range(len(tests))]}
        print(name, f["name"], [None if e is None else round(e, 4) for e in found[f["name"]]["rms"]], flush=True)
    return found


def kept(f):
    """What results.json has of a fit."""
    return {key: f[key] for key in ("tests", "seconds", "verdict", "material", "parameters", "rms")}


# ---- silicones

def read_silicone(path):
    """(stretch, nominal stress [Pa]) up to the greatest stress, after which the specimen breaks."""
    with open(path, encoding="latin-1") as file:
        lines = file.read().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("Time"))
    rows = [[float(v) for v in line.split(";")[:5]] for line in lines[first + 1:] if line.strip(";")]
    rows = [(1.0 + r[3], r[4] * MPA) for r in rows if r[3] > 0]
    top = max(range(len(rows)), key=lambda i: rows[i][1])
    return rows[:top + 1]


def thinned(rows):
    """The points nearest to strains that are evenly spread."""
    last = rows[-1][0]
    wanted = [rows[0][0] + (last - rows[0][0]) * i / (POINTS - 1) for i in range(POINTS)]
    return sorted({min(rows, key=lambda r: abs(r[0] - w)) for w in wanted})


def test(name, mode, rows, **more):
    return {"name": name, "mode": mode, "stretch": [r[0] for r in rows], "stress": [r[1] for r in rows], **more}


def silicones(work, program):
    found, drawn = {}, []
    for path in sorted((common.shared_data() / "silicone-tensile").glob("*.csv")):
        rows = read_silicone(path)
        small = [r for r in rows if r[0] <= 1 + SMALL]
        tests = [test("thinned", "uniaxial", thinned(rows)), test("all", "uniaxial", rows), test("small", "uniaxial", small)]
        # Under tension alone a linear law's stress does not depend on Poisson's ratio; with this one no side vanishes.
        nu = min(0.45, 0.9 / (rows[-1][0] - 1))
        fits = fit(work, program, path.stem, tests, [
            {"name": "ogden", "tests": [0], "poisson_ratio": INCOMPRESSIBLE},
            {"name": "linear", "tests": [0], "poisson_ratio": nu, "law": "linear"},
            {"name": "linear, small", "tests": [2], "poisson_ratio": nu, "law": "linear"}])
        found[path.stem] = {"points": len(rows), "strain": rows[-1][0] - 1, "greatest_stress": max(r[1] for r in rows),
                            "fits": {key: kept(f) for key, f in fits.items()}}
        drawn.append((path.stem.replace("_", " "), rows, {key: f["stress"][1] for key, f in fits.items()}))
    return found, drawn


# ---- rubbers, a gel, brain

MODES = {"UT": "uniaxial", "UC": "uniaxial", "PS": "pure_shear", "ET": "equibiaxial", "BT": "biaxial", "SS": "simple_shear", "CSS": "simple_shear"}


SPOILT = "Katashima_2012__BT"  # both stretches are the same in the file, the stresses are not: no isotropic material


def read_multiaxial(path):
    """The tests of a file: one for each stress that was measured."""
    author, _, rest = path.stem.partition("__")
    unit = next((u for name, u in UNITS.items() if author.startswith(name)), MPA)
    kind = rest.split("_")[0]
    with open(path, newline="") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    cauchy = "cauchy_11" in rows[0]
    prefix = "cauchy_" if cauchy else "PK1_"
    shear = MODES[kind] == "simple_shear"
    measured = [("first", "12" if shear else "11")] + ([("second", "22")] if MODES[kind] == "biaxial" and not cauchy else [])
    tests = []
    for measure, column in measured:
        stress = [unit * r[prefix + column] for r in rows]
        if not any(stress):
            continue
        one = {"name": rest + (", second" if measure == "second" else ""), "mode": MODES[kind], "measure": "cauchy_difference" if cauchy else measure,
               "stretch": [r["F12" if shear else "F11"] for r in rows], "stress": stress}
        if MODES[kind] == "biaxial":
            one["second"] = [r["F22"] for r in rows]
        if shear:
            one["prestretch"] = rows[0]["F11"]
        tests.append(one)
    return tests


def brain_region(name):
    return next((r for r in ("basal_ganglia", "corona_radiata", "corpus_callosum", "cortex") if r in name), None)


def multiaxial_sets():
    """{set: tests}; brain by regions."""
    sets = {}
    for path in sorted((common.shared_data() / "rubber-brain-multiaxial").glob("*.csv")):
        if path.stem == SPOILT:
            continue
        author = path.stem.split("__")[0].replace("_", " ")
        region = brain_region(path.stem)
        key = f"{author}, {region.replace('_', ' ')}" if region else author
        sets.setdefault(key, []).extend(read_multiaxial(path))
    return sets


def kind_of(test):
    return test["name"].replace(",", "_").split("_")[0]


def multiaxial(work, program):
    found, drawn = {}, []
    for name, tests in multiaxial_sets().items():
        first = [i for i, t in enumerate(tests) if t["mode"] == "uniaxial"] or [i for i, t in enumerate(tests) if t["mode"] == "pure_shear"]
        # With an equibiaxial or, of brain, a shear test beside, where anything is left to predict.
        second = [i for i, t in enumerate(tests) if t["mode"] == "equibiaxial" or kind_of(t) == "SS"]
        if len(first) + len(second) == len(tests):
            second = []
        fits = fit(work, program, name.replace(" ", "-").replace(",", ""), tests, [
            {"name": "one mode", "tests": first, "poisson_ratio": INCOMPRESSIBLE},
            *([{"name": "two modes", "tests": first + second, "poisson_ratio": INCOMPRESSIBLE}] if second else []),
            {"name": "all", "tests": list(range(len(tests))), "poisson_ratio": INCOMPRESSIBLE}])
        found[name] = {"tests": [{"name": t["name"], "mode": t["mode"], "kind": kind_of(t), "points": len(t["stress"]),
                                  "range": [min(t["stretch"]), max(t["stretch"])], "greatest_stress": max(map(abs, t["stress"]))} for t in tests],
                       "fitted_mode": tests[first[0]]["mode"], "fits": {key: kept(f) for key, f in fits.items()}}
        drawn.append((name, tests, fits))
    return found, drawn


# ---- foam

def foam(work, program):
    modes = {"foam_UT": "uniaxial", "foam_UC": "confined", "foam_SS": "simple_shear"}
    tests = []
    for name, mode in modes.items():
        with open(common.shared_data() / f"shoe-foam-leap/{name}.csv", newline="") as file:
            rows = [(float(r["lambda"]), MPA * float(r["P_MPa"])) for r in csv.DictReader(file)]
        tests.append(test(name, mode, rows))
    both, everything = [0, 1], [0, 1, 2]
    fits = fit(work, program, "foam", tests, [
        {"name": "tension and compression", "tests": both, "poisson_ratio": None},
        {"name": "all", "tests": everything, "poisson_ratio": None},
        {"name": "all, Poisson's ratio 0.45", "tests": everything, "poisson_ratio": 0.45},
        {"name": "linear, all", "tests": everything, "poisson_ratio": None, "law": "linear"}])
    found = {"tests": [{"name": t["name"], "mode": t["mode"], "points": len(t["stress"])} for t in tests], "fits": {key: kept(f) for key, f in fits.items()}}
    return found, (tests, fits)


def main():
    arguments = common.arguments(__doc__.splitlines()[0])
    figures, drawn = {"poisson_ratio": INCOMPRESSIBLE, "points": POINTS, "small": SMALL}, {}
    for name, of in (("silicones", silicones), ("multiaxial", multiaxial), ("foam", foam)):
        figures[name], drawn[name] = of(arguments.work, arguments.program)
    common.write_results(__file__, figures)
    try:
        import pictures
    except ImportError:
        print("matplotlib is not installed: no pictures")
        return
    pictures.draw(drawn, IMAGES)


if __name__ == "__main__":
    main()
