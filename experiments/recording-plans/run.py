#!/usr/bin/env python3
"""What a recording would tell before it is made: `pliant check --plan` of one situation and of changes to it, one at a time."""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

SCENE = (common.ROOT / "examples/synthetic-ring/scene.toml").read_text()


def with_value(text, key, value):
    changed, count = re.subn(rf"(?m)^{key} = [^#\n]*", f"{key} = {value} ", text, count=1)
    if not count:
        raise SystemExit(f"the scene has no {key}")
    return changed


def in_each(text, **values):
    for key, value in values.items():
        text = with_value(text, key, value)
    return text


CHANGES = {
    "as it is: 60 Hz, 46 frames from the release on, 1 m away, 0.35 m high": lambda t: t,
    "30 Hz": lambda t: in_each(t, frame_rate=30.0, frame_count=24, start_frame=1, substeps=16),
    "15 Hz": lambda t: in_each(t, frame_rate=15.0, frame_count=12, start_frame=0, substeps=32),
    "120 Hz": lambda t: in_each(t, frame_rate=120.0, frame_count=96, start_frame=4, substeps=4),
    "half as long": lambda t: in_each(t, frame_count=24),
    "let go 0.1 m higher": lambda t: in_each(t, translation="[0.0, 0.45, 0.0]"),
    "camera twice as far": lambda t: in_each(t, eye="[0.7, 1.05, 1.8]"),
    "thrown, nobody knows how fast": lambda t: t + "\n[initial]\nlinear_velocity = [0.3, 0.0, 0.1]\nangular_velocity = [0.5, 0.0, -0.5]\nknown = false\n",
    "floor known to a few centimetres only, and not seen": lambda t: t.replace("[[plane]]", "[[plane]]\nknown = false\nhalf_size = 0.0"),
    "friction measured": lambda t: t.replace("[[plane]]", "[[plane]]\nfriction = 0.3"),
    "ten times stiffer": lambda t: in_each(t, youngs_modulus=40000.0, substeps=24),
    "hardly damped": lambda t: in_each(t, stiffness_damping=0.0005),
}


def main():
    arguments = common.arguments(__doc__)
    rows = {}
    for i, (name, change) in enumerate(CHANGES.items()):
        scene, out = arguments.work / f"{i}.toml", arguments.work / str(i)
        scene.write_text(change(with_value(SCENE, "truth_trajectory", "false")))
        if not (out / "plan.json").exists():
            common.run(arguments.program, "check", "--plan", scene, "--out", out)
        plan = common.read(out / "plan.json")["parameters"]
        truth = {key: p["value"] for key, p in common.read(out / "truth.json")["parameters"].items()}
        rows[name] = {key: {"half_width": common.number(0.5 * (p["interval_90"][1] - p["interval_90"][0]) / truth[key], 3), "cause": p.get("largest_cause")}
                      for key, p in plan.items() if key in ("youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping") and truth.get(key)}
        print(name, rows[name], flush=True)
    common.write_results(__file__, {"plans": rows})


if __name__ == "__main__":
    main()
