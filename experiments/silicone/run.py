#!/usr/bin/env python3
"""One depth image each of silicone bars at rest: two shapes of one silicone that hang from a clamp, and a bar of two silicones
that is twisted by half a turn. Standard library only; under five minutes."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common

POSE = {"sensor_turn.estimate": True, "sensor_shift.estimate": True}
NEARLY_INCOMPRESSIBLE = {"poisson_ratio": 0.49, "poisson_ratio.estimate": False}
QUADRATIC = {"element": "quadratic_tetrahedra"}
TWO_SILICONES = """
[[region]]
name = "mold star 15"
half_space = { point = [-0.0825, 0, 0], normal = [-1, 0, 0] }
"""
# The twisted bar shows a ratio alone: the softer half is given what the hanging bars say, with a tenth of deviation.
ANCHOR = {"youngs_modulus": 155e3, "youngs_modulus.prior_std": 0.1}

# name: (recording, choices)
FITS = {
    "bar": ("silicone-h_e_c", {"cells": 20, "coarse_cells": 12, **POSE}),
    "bar-finer": ("silicone-h_e_c", {"cells": 28, "coarse_cells": 12, **POSE}),
    "bar-quadratic": ("silicone-h_e_c", {"cells": 12, **QUADRATIC, **POSE}),
    "bar-given-pose": ("silicone-h_e_c", {"cells": 20, "coarse_cells": 12}),
    "bar-raw": ("silicone-h_e_c-raw", {"cells": 20, "coarse_cells": 12, "range_error": 0.03, "range_error.estimate": True, "range_error.prior_std": 1.0, **POSE}),
    "bar-raw-from-zero": ("silicone-h_e_c-raw", {"cells": 20, "coarse_cells": 12, "range_error.estimate": True, "range_error.prior_std": 5.0, **POSE}),
    "spine-coarse": ("silicone-h_e_s", {"cells": 44, "coarse_cells": 24, "youngs_modulus": 170e3, **POSE}),
    "spine": ("silicone-h_e_s", {"cells": 54, "coarse_cells": 24, "youngs_modulus": 170e3, **POSE}),
    "spine-finer": ("silicone-h_e_s", {"cells": 64, "coarse_cells": 24, "youngs_modulus": 170e3, **POSE}),
    "spine-given-pose": ("silicone-h_e_s", {"cells": 54, "coarse_cells": 24, "youngs_modulus": 170e3}),
    "spine-given-pose-finer": ("silicone-h_e_s", {"cells": 64, "coarse_cells": 24, "youngs_modulus": 170e3}),
    "bar-given-pose-finer": ("silicone-h_e_c", {"cells": 28, "coarse_cells": 12}),
    "twisted-coarse": ("silicone-t_em_c", {"cells": 24, "coarse_cells": 10, **ANCHOR}),
    "twisted": ("silicone-t_em_c", {"cells": 32, "coarse_cells": 10, **ANCHOR}),
    "twisted-finer": ("silicone-t_em_c", {"cells": 40, "coarse_cells": 10, **ANCHOR}),
    "twisted-pose": ("silicone-t_em_c", {"cells": 24, "coarse_cells": 10, **ANCHOR, **POSE}),
    "twisted-pose-finer": ("silicone-t_em_c", {"cells": 32, "coarse_cells": 10, **ANCHOR, **POSE}),
}


def captures(work):
    """Folders that point at the recordings' files: with the range as recorded, and with the second silicone named."""
    shared = common.shared_data()
    for name, source, text in (
            ("silicone-h_e_c", "silicone-h_e_c", lambda t: t), ("silicone-h_e_s", "silicone-h_e_s", lambda t: t),
            ("silicone-t_em_c", "silicone-t_em_c", lambda t: t + TWO_SILICONES),
            ("silicone-h_e_c-raw", "silicone-h_e_c", lambda t: t)):
        folder = work / "captures" / name
        folder.mkdir(parents=True, exist_ok=True)
        raw = name.endswith("-raw")
        written = text((shared / source / ("capture_raw.toml" if raw else "capture.toml")).read_text())
        if raw:  # the noise given there stands for the range error, which is estimated here
            written = "\n".join("noise = 0.003" if line.startswith("noise") else line for line in written.splitlines()) + "\n"
        (folder / "capture.toml").write_text(written)
        for file in ("rest.ply", "depth", "depth_raw", "masks"):
            link = folder / file
            if not link.is_symlink():
                link.symlink_to((shared / source / file).resolve())
    return work / "captures"


def main():
    arguments = common.arguments(__doc__)
    folder = captures(arguments.work)
    fits = {}
    for name, (recording, choices) in FITS.items():
        figures = common.fit(arguments.program, folder / recording, arguments.work / name, {**NEARLY_INCOMPRESSIBLE, **choices})
        result = figures["result"]
        fits[name] = {"recording": recording, "cells": choices["cells"], "element": choices.get("element", "hexahedra"),
                      "pose_is_estimated": "sensor_turn.estimate" in choices, "wall_seconds": figures["wall_seconds"],
                      "surface_rms": result["error"]["surface_rms"],
                      "parameters": {key: {"value": p["value"], "std": p["std"]} for key, p in result["parameters"].items() if p.get("std") is not None},
                      "correlations": result["identifiability"], "notes": result.get("notes", [])}
        print(name, fits[name]["parameters"].get("youngs_modulus"), flush=True)
    common.write_results(__file__, {"poisson_ratio": NEARLY_INCOMPRESSIBLE["poisson_ratio"], "fits": fits})


if __name__ == "__main__":
    main()
