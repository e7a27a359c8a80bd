#!/usr/bin/env python3
"""Load-free shapes of objects that sag: the kinds of object of Wang 2015, table 2, and its section 6.1.

Of each object a load-free shape is known. It sags under its weight; that is the scan, from which the shape is looked for by
three schemes. First with the scan's own mesh (an inverse crime: what is looked for is known to be there), at several sizes;
then with the scan's surface meshed anew; then for a material that is too soft."""
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import tracks

IMAGES = common.ROOT / "docs/images"
# Young's moduli [Pa] for a small and a large sag; sizes of tetrahedra [m], from coarse to fine; of the scan's new mesh.
OBJECTS = {
    "plant": {"moduli": [1e8, 3e7], "cell_sizes": [0.06, 0.04, 0.026], "scan_cell_size": 0.032},
    "beam": {"moduli": [3e7, 5e6], "cell_sizes": [0.03, 0.0125, 0.01], "scan_cell_size": 0.0115},
    "holder": {"moduli": [4e7, 8e6], "cell_sizes": [0.045, 0.02, 0.014, 0.0128], "scan_cell_size": 0.0165},
}
RIVAL_ITERATIONS, RIVAL_TOLERANCE = 150, 1e-6  # rounding leaves up to 3e-8
SOFTER = 30.0


def run(arguments, name, **choices):
    figures = tracks.run(arguments.program.parent.parent / "experiments/pliant_reference_shapes", arguments.work / f"{name}.json", choices)
    for row in figures["schemes"]:
        print(name, {key: row[key] for key in ("scheme", "found", "seconds", "static_error", "known_error") if key in row}, flush=True)
    return figures


def main():
    arguments = common.arguments(__doc__)
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    recovered, schemes, remeshed, refused = [], [], [], []
    for name, choice in OBJECTS.items():
        coarse, middle, fine, *_ = choice["cell_sizes"]
        small_sag, large_sag = choice["moduli"]
        for E, cell_size in [(small_sag, coarse), *((large_sag, size) for size in choice["cell_sizes"])]:
            drawn = {"picture": IMAGES / f"reference-shapes-{name}.png"} if (E, cell_size) == (large_sag, middle) else {}
            recovered.append(run(arguments, f"recover-{name}-{E:g}-{cell_size:g}", object=name, youngs_modulus=E, cell_size=cell_size, **drawn))
        schemes.append(run(arguments, f"schemes-{name}", object=name, youngs_modulus=large_sag, cell_size=coarse, schemes="newton,virtual_force",
                           max_iterations=RIVAL_ITERATIONS, tolerance=RIVAL_TOLERANCE))
        remeshed.append(run(arguments, f"remesh-{name}", object=name, youngs_modulus=large_sag, cell_size=fine,
                            scan_cell_size=choice["scan_cell_size"], task="remesh"))
    for name, choice in OBJECTS.items():
        cell_size = choice["cell_sizes"][0]
        refused.append(run(arguments, f"refuse-{name}-{cell_size:g}", object=name, youngs_modulus=choice["moduli"][1], cell_size=cell_size,
                           task="refuse", softer=SOFTER))
    common.write_results(__file__, {"recovered": recovered, "schemes": schemes, "remeshed": remeshed, "refused": refused})


if __name__ == "__main__":
    main()
