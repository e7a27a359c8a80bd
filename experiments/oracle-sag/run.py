#!/usr/bin/env python3
"""A drooping leaf, scanned as it droops, then pulled aside and let go: a recording of another simulator (other elements, another
material law, three depth sensors fused to clouds). Neither its load-free shape nor its material is known.

Fitted with no choice of ours, with shape and material in turns (Wang 2015, algorithm 1), and as if the scan were load-free.
truth.json and the true shapes are read for judging only. Standard library only."""
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

RECORDING = "oracle-sag"
NAMES = ["youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping"]
# name: (whether the scan is said to be load-free, choices)
FITS = {
    "together": (False, {}),
    "in-turns": (False, {"load_free": "staggered"}),
    "scan-load-free": (True, {"element": "tetrahedra", "steps": 0.5, "starts": 1}),  # no cell of the hexahedra holds the stalk
}


def minus(a, b):
    return [tuple(x - y for x, y in zip(p, q)) for p, q in zip(a, b)]


def lengths(vectors):
    return [math.hypot(*v) for v in vectors]


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def sagged(program, fit, places):
    """Where vertices of a fit's load-free surface come to rest under gravity: as the nearest nodes of its volume do."""
    nodes, moved = common.at_rest(program, fit)
    out = []
    for p in places:
        n = min(range(len(nodes)), key=lambda k: (nodes[k][0] - p[0])**2 + (nodes[k][1] - p[1])**2 + (nodes[k][2] - p[2])**2)
        out.append(tuple(p[d] + moved[3 * n + d] for d in range(3)))
    return out


def judge(program, fit, data):
    """The load-free shape, and what it sags into, against the true ones, vertex by vertex."""
    reference, static = common.read_vertices(data / "truth/reference.ply"), common.read_vertices(data / "truth/static.ply")
    found = common.read_vertices(fit / "surface.ply")
    size = max(max(p[d] for p in reference) - min(p[d] for p in reference) for d in range(3))
    sag = lengths(minus(static, reference))
    off = lengths(minus(found, reference))
    rest = sagged(program, fit, found)
    return {"size": common.number(size), "true_sag_rms": common.number(rms(sag)), "true_sag_greatest": common.number(max(sag)),
            "load_free_rms": common.number(rms(off) / size, 3), "load_free_greatest": common.number(max(off) / size, 3),
            "sag_error": common.number(rms(lengths(minus(minus(rest, found), minus(static, reference)))) / rms(sag), 3),
            "static_rms": common.number(rms(lengths(minus(rest, static))) / size, 3),
            "static_error_of_sag": common.number(rms(lengths(minus(rest, static))) / rms(sag), 3)}


def main():
    arguments = common.arguments(__doc__, gather={"action": "store_true", "help": "no new fits: gather those that are in --work, and leave the others as they are stored"})
    data = common.shared_data() / RECORDING
    if not (data / "capture.toml").exists():
        raise SystemExit(f"{data} is not there")
    truth = common.read(data / "truth.json")["parameters"]
    taken = arguments.work / "captures/load-free"
    taken.mkdir(parents=True, exist_ok=True)
    (taken / "capture.toml").write_text((data / "capture.toml").read_text().replace('shape_is = "static"', 'shape_is = "reference"'))
    for name in ("rest.ply", "clouds"):
        if not (taken / name).is_symlink():
            (taken / name).symlink_to((data / name).resolve())
    file = HERE / "results.json"
    fits = common.read(file)["fits"] if arguments.gather and file.exists() else {}
    for name, (is_taken, choices) in FITS.items():
        if arguments.gather and not (arguments.work / name / "figures.json").exists():
            continue
        figures = common.fit(arguments.program, taken if is_taken else data, arguments.work / name, choices)
        result = figures.pop("result")
        parameters = {key: {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "unit": p["unit"],
                            "truth": truth.get(key, {}).get("value")}
                      for key, p in result["parameters"].items() if key in NAMES}
        fits[name] = {"choices": choices, "parameters": parameters, "surface_rms": common.number(result["error"]["surface_rms"], 4),
                      "cost": common.number(result["cost"]["final"]), "forward_steps": result["time"].get("forward_steps"),
                      "converged": figures["exit_code"] == 0, "commit": result["software"]["commit"], **figures,
                      **judge(arguments.program, arguments.work / name, data)}
        print(name, {key: fits[name][key] for key in ("load_free_rms", "load_free_greatest", "sag_error", "static_error_of_sag", "wall_seconds")},
              {key: p["value"] for key, p in parameters.items()}, flush=True)
    common.write_results(__file__, {"fits": fits})


if __name__ == "__main__":
    main()
