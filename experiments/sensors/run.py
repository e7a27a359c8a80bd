#!/usr/bin/env python3
"""Checks every recording of this folder with `pliant check` and gathers the figures in results.json.

Usage: experiments/sensors/run.py PLIANT [OUT]
  PLIANT  the program, as build/release/apps/pliant
  OUT     folder for pictures and point clouds (default: out-sensors)

Needs the shared recordings beside the project (../shared/data); Python's own library is enough.
"""

import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
DATA = "../../../../shared/data"
# Reference masks: of the ball, while nothing touches it and later; of the dog.
EXTRA = {
    "plush-press": ["--pictures", "51", "--compare-masks", f"{DATA}/plush-press-rgbd/mask_ball/%06d.png"],
    "plush-pair": ["--compare-masks", f"{DATA}/plush-depth-pair/snoopy_omask_00005%d.png"],
}
UNTOUCHED = 36  # frames of plush-press before the first touch, by its README


def check(program: str, capture: pathlib.Path, out: pathlib.Path) -> dict:
    command = [program, "check", str(capture), "--out", str(out), *EXTRA.get(capture.name, [])]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{capture.name}: exit code {done.returncode}\n{done.stderr}")
    return json.loads((out / "check.json").read_text())


def millimetres(metres: float) -> float:
    return round(1e3 * metres, 2)


def figures(name: str, report: dict) -> dict:
    result = {"frames": report["frames"], "cannot": report["impossible"]}
    for scene in report.get("scenes", []):
        result.setdefault("scenes", []).append({
            "camera": scene["camera"],
            "plane_rms_mm": [millimetres(plane["rms"]) for plane in scene.get("planes", [])],
            "objects": len(scene.get("objects", [])),
            "standing_objects_mm": [[round(1e3 * side) for side in found["extent"]]
                                    for found in scene.get("objects", []) if found["stands_on_plane"]],
        })
    for cloud in report.get("clouds", []):
        result["cloud"] = {"points": cloud["points"], "extent_mm": [round(1e3 * side) for side in cloud["extent"]]}
    overlaps = report.get("mask_overlap", [])
    if name == "plush-press":
        split = {"untouched": [o for o in overlaps if o["frame"] < UNTOUCHED],
                 "touched": [o for o in overlaps if o["frame"] >= UNTOUCHED]}
    else:
        split = {"all": overlaps} if overlaps else {}
    for part, some in split.items():
        ious = sorted(o["iou"] for o in some)
        result.setdefault("mask_iou", {})[part] = {
            "frames": len(ious), "least": round(ious[0], 3), "median": round(ious[len(ious) // 2], 3)}
    return result


def main() -> None:
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    out = pathlib.Path(sys.argv[2] if len(sys.argv) == 3 else "out-sensors")
    captures = sorted(path.parent for path in HERE.glob("*/capture.toml"))
    results = {c.name: figures(c.name, check(sys.argv[1], c, out / c.name)) for c in captures}
    (HERE / "results.json").write_text(json.dumps(results, indent=2) + "\n")
    print(f"{len(results)} recordings checked; figures in {HERE / 'results.json'}, pictures in {out}")


if __name__ == "__main__":
    main()
