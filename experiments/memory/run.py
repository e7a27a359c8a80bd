#!/usr/bin/env python3
"""Peak memory of a fit of 600 frames at about 2,400 nodes: tangents (the default optimiser) and adjoint (Rprop).

The steps are made twice as long as the default and iterations are few: memory, not accuracy, is looked at.
A shorter recording shows what of the memory grows with the frames."""
import csv
import io
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

CELLS = 21  # 2,418 nodes
CHOICES = {"cells": CELLS, "coarse_cells": 4, "steps": 0.5, "max_iterations": 1, "points_per_frame": 200,
           "youngs_modulus": 5000, "poissons_ratio.estimate": False}


def adjoint_growth(program):
    """Bytes of states that a reverse sweep holds, over the number of frames, at a budget that is soon passed."""
    measure = program.parent.parent / "experiments/pliant_adjoint_memory"
    text = subprocess.run([measure, "1"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return [{key: int(value) for key, value in row.items()} for row in csv.DictReader(io.StringIO(text))]


def main():
    arguments = common.arguments(__doc__)
    text = (HERE / "scene.toml").read_text()
    rows = []
    for frames in (150, 600):
        capture = arguments.work / f"capture-{frames}"
        scene = arguments.work / f"scene-{frames}.toml"
        scene.write_text(text.replace("frame_count = 601", f"frame_count = {frames + 1}"))
        common.run(arguments.program, "synth", scene, "--out", capture)
        for optimiser in ("levenberg_marquardt", "rprop"):
            out = arguments.work / f"{optimiser}-{frames}"
            figures = common.fit(arguments.program, capture, out, {**CHOICES, "optimiser": optimiser}, threads=1)
            head = (out / "model.vtu").read_bytes()[:4000].decode(errors="replace")
            rows.append({"frames": frames, "optimiser": optimiser, "nodes": int(re.search(r'NumberOfPoints="(\d+)"', head)[1]),
                         "peak_memory_mib": figures["peak_memory_mib"], "wall_seconds": figures["wall_seconds"],
                         "forward_steps": figures["result"]["time"]["forward_steps"]})
            print(rows[-1], flush=True)
    common.write_results(__file__, {"settings": CHOICES, "fits": rows, "adjoint": adjoint_growth(arguments.program)})


if __name__ == "__main__":
    main()
