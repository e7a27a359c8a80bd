#!/usr/bin/env python3
"""Recordings of a ring made by another simulator (other elements, another material law, a sensor's faults).

Two bounces are fitted with no choice of ours; each model predicts the other bounce. A third recording, of a pebble on a tilted board, is
fitted alike. truth.json is read for judging only."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

RECORDINGS = ["oracle-bounce-a", "oracle-bounce-b", "oracle-ramp"]
NAMES = ["youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping"]


def truth_of(capture):
    """Values by name; the recordings' truth.json may nest them."""
    found = {}

    def walk(node):
        for key, value in node.items():
            if isinstance(value, dict) and "value" in value:
                found[key] = value["value"]
            elif isinstance(value, dict):
                walk(value)
            elif isinstance(value, (int, float)):
                found[key] = value

    walk(common.read(capture / "truth.json"))
    return {name: found[name] for name in NAMES if name in found}


def main():
    arguments = common.arguments(__doc__)
    data = common.shared_data()
    recordings = {}
    for name in RECORDINGS:
        if not (data / name / "capture.toml").exists():
            print(f"{name}: not there, left out")
            continue
        figures = common.fit(arguments.program, data / name, arguments.work / name)
        result, truth = figures.pop("result"), truth_of(data / name)
        parameters = {}
        for key in NAMES:
            p = result["parameters"][key]
            parameters[key] = {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "unit": p["unit"],
                               "truth": truth.get(key), "interval_90": common.rounded(p["interval_90"], 5) if p.get("interval_90") else None}
        recordings[name] = {"parameters": parameters, "surface_rms": common.number(result["error"]["surface_rms"], 4),
                            "points": result["error"]["points"], "cost": common.number(result["cost"]["final"]),
                            "converged": figures["exit_code"] == 0, "starts": len(result["starts"]), **figures}
        common.run(arguments.program, "check", data / name, "--out", arguments.work / (name + "-check"), "--pictures", 1)
        recordings[name]["sensor_noise"] = common.number(common.read(arguments.work / (name + "-check") / "check.json")["noise"], 3)
        E = parameters["youngs_modulus"]
        print(f"{name}: E {E['value']} ({E['truth']}), nu {parameters['poisson_ratio']['value']}, "
              f"rms {1e3 * recordings[name]['surface_rms']:.2f} mm, {figures['wall_seconds']} s", flush=True)
    pairs = []
    for model, other in [("oracle-bounce-a", "oracle-bounce-b"), ("oracle-bounce-b", "oracle-bounce-a")]:
        if model in recordings and other in recordings:
            error = common.evaluate(arguments.program, arguments.work / model / "model.toml", data / other,
                                    arguments.work / f"{model}-on-{other}.json")["error"]
            pairs.append({"model": model, "recording": other, "surface_rms": common.number(error["surface_rms"], 4)})
    common.write_results(__file__, {"recordings": recordings, "predictions": pairs})


if __name__ == "__main__":
    main()
