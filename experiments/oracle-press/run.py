"""A stiffening foam block from another simulator, fitted by each material and judged on presses by another disc.

    python3 experiments/oracle-press/run.py OUT [--pliant PROGRAM] [--materials ...] [--set KEY=VALUE ...]

Errors are root mean squares of the markers over the greatest measured displacement of a press: against the markers as
they were measured (0.5 mm of noise a coordinate), and against where the other simulator had them.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import time

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common  # noqa: E402


def without_noise(data, folder):
    """The capture with the true markers under load, for judging."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "press").mkdir(exist_ok=True)
    truth = np.load(data / "truth" / "presses.npz")
    with open(data / "markers_rest.csv") as file:
        ids = [row["id"] for row in csv.DictReader(file)]
    for press, positions in enumerate(truth["markers"]):
        with open(folder / "press" / f"{press:03d}.csv", "w") as file:
            file.write("id,x,y,z\n")
            for marker, p in zip(ids, positions.astype(float)):
                if np.isfinite(p).all():
                    file.write(f"{marker},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}\n")
    with open(folder / "markers_rest.csv", "w") as file:
        file.write("id,x,y,z\n")
        for marker, p in zip(ids, truth["markers_rest"].astype(float)):
            file.write(f"{marker},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}\n")
    (folder / "rest.ply").write_bytes((data / "rest.ply").read_bytes())
    (folder / "capture.toml").write_text((data / "capture.toml").read_text())
    return folder


def evaluate(program, model, capture, out):
    subprocess.run([program, "evaluate", str(model), str(capture), "-o", str(out)], stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, check=False)
    return json.loads(out.read_text())["presses"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--pliant", default=str(common.DEFAULT_PROGRAM))
    parser.add_argument("--materials", nargs="*", default=["ogden", "sampled", "linear"])
    parser.add_argument("--set", nargs="*", default=[], dest="settings")
    arguments = parser.parse_args()
    data = common.shared_data() / "oracle-press"
    arguments.out.mkdir(parents=True, exist_ok=True)
    judge = without_noise(data, arguments.out / "truth")
    file = HERE / "results.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    for material in arguments.materials:
        out = arguments.out / material
        begin = time.time()
        settings = [word for setting in [f"material={material}", *arguments.settings] for word in ("--set", setting)]
        with open(arguments.out / f"{material}.log", "w") as log:
            subprocess.run([arguments.pliant, "fit", str(data), "--out", str(out), *settings], stdout=log, stderr=log,
                           check=False)
        entry = {"seconds": round(time.time() - begin, 1), "settings": arguments.settings}
        fitted = json.loads((out / "result.json").read_text())
        entry["parameters"] = {p: [v["value"], v.get("std")] for p, v in fitted["parameters"].items()}
        entry["notes"] = fitted.get("notes", [])
        for name, capture in (("measured", data), ("true", judge)):
            presses = evaluate(arguments.pliant, out / "model.toml", capture, out / f"evaluation_{name}.json")
            entry[name] = {
                role: float(np.mean([p["relative_error"] for p in presses if p["role"] == role]))
                for role in ("fit", "test")
            }
            entry[name]["presses"] = [[p["role"], p["max_displacement"], p["marker_rms"], p["relative_error"]]
                                      for p in presses]
        results[material] = entry
        print(material, entry["seconds"], "s measured", {k: entry["measured"][k] for k in ("fit", "test")}, "true",
              {k: entry["true"][k] for k in ("fit", "test")}, flush=True)
        file.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
