#!/usr/bin/env python3
"""A silicone arm whose chamber was inflated and vented: the swing that is left after venting gives the stiffness in bending of
a solid arm of its outer shape. The chambers' shape and the pressure over time were not recorded. Standard library only."""
import math
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common
from common import mean

FOLDER = "soft-arm-mocap"
TIPS = ["tip1", "tip2", "tip3"]
STEPS = [100, 150, 200, 250, 300]     # mbar; after higher ones the arm swings less than it creeps
LENGTH, RADIUS, DENSITY, RATE = 0.1, 0.0222, 1070.0, 100.0
POISSON = 0.49
AUTHORS = 263824.0     # Young's modulus [Pa] that the recording's authors state
FRAMES = 26


def read_tip(pressure):
    """Mean of the three markers at the tip [m], a frame at a time, about where it comes to rest."""
    tip = [mean(list(frame.values())) for frame in common.read_markers(common.shared_data() / FOLDER / f"step_{pressure}mbar.csv", TIPS)]
    end = mean(tip[-30:])
    return [[a - b for a, b in zip(p, end)] for p in tip]


def turning_point(tip):
    """The first frame after venting in which the arm turns back, on the other side of rest; and its swings, half periods."""
    far = max(range(len(tip)), key=lambda k: math.dist(tip[k], (0, 0, 0)))
    towards = [v / math.dist(tip[far], (0, 0, 0)) for v in tip[far]]
    s = [sum(a * b for a, b in zip(p, towards)) for p in tip]
    vent = max(k for k in range(len(s)) if s[k] > 0.9 * max(s))
    turns = [k for k in range(vent + 2, len(s) - 1) if (s[k] - s[k - 1]) * (s[k + 1] - s[k]) <= 0]
    return turns[0], [s[k] for k in turns[:9]], turns[:9]


def beam_modulus(frequency):
    """Young's modulus [Pa] of a clamped solid cylinder whose first bending has this frequency [Hz]: Euler and Bernoulli's beam with
    rotary inertia and shear to first order. Weight is left out."""
    area, second = math.pi * RADIUS ** 2, 0.25 * math.pi * RADIUS ** 4
    rotary = 4.648 * second / (area * LENGTH ** 2)
    shear = 6 * (1 + POISSON) / (7 + 6 * POISSON)
    compliance = (1 + rotary) * area * LENGTH ** 4 / (1.8751040687 ** 4 * second)
    compliance += 2 * (1 + POISSON) / shear / (0.5 * math.pi / LENGTH) ** 2
    return DENSITY * (2 * math.pi * frequency) ** 2 * compliance


def write_surface(path):
    data = (common.shared_data() / FOLDER / "Cylinder_muscle.stl").read_bytes()
    index, triangles = {}, []
    for i in range(struct.unpack("<I", data[80:84])[0]):
        v = struct.unpack("<12f", data[84 + 50 * i:132 + 50 * i])[3:]
        # Along x, clamped at x = 0: the authors clamp z = 100 mm.
        triangles.append([index.setdefault((round(LENGTH - 1e-3 * v[k + 2], 7), round(1e-3 * v[k + 1], 7), round(1e-3 * v[k], 7)), len(index))
                          for k in (0, 3, 6)])
    path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in index) +
                    "".join("f " + " ".join(str(n + 1) for n in t) + "\n" for t in triangles))


def write_capture(folder, pressure, tip, start):
    folder.mkdir(parents=True, exist_ok=True)
    write_surface(folder / "arm.obj")
    (folder / "rest.csv").write_text(f"id,x,y,z\ntip,{LENGTH},0,0\n")
    rows = [f"{k},tip,{LENGTH + p[0]:.9g},{p[1]:.9g},{p[2]:.9g}\n" for k, p in enumerate(tip[start:start + FRAMES])]
    (folder / "track.csv").write_text("frame,id,x,y,z\n" + "".join(rows))
    common.write_capture(
        folder, f"soft arm after {pressure} mbar", object={"surface": "arm.obj", "density": DENSITY},
        world={"gravity": [9.81, 0.0, 0.0]}, timing={"frame_rate": RATE, "frame_count": FRAMES, "start_frame": 0},
        initial={"released": True}, fixed=[{"half_space": {"point": [0.001, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]}}],
        markers=[{"rest": "rest.csv", "track": "track.csv"}])


def main():
    arguments = common.arguments(__doc__, fit={"action": "store_true", "help": "also fit the first release, which takes long"},
                                 limit={"type": float, "default": 900.0, "help": "seconds after which that fit ends with what it has"})
    recordings, fits = [], []
    for pressure in STEPS:
        tip = read_tip(pressure)
        start, swings, turns = turning_point(tip)
        # A drift is in all of them: from turn to turn, not from rest.
        heights = [abs(a - b) for a, b in zip(swings, swings[1:])]
        ratio = (heights[-1] / heights[0]) ** (1.0 / (len(heights) - 1))
        frequency = (len(turns) - 1) * 0.5 * RATE / (turns[-1] - turns[0])
        recordings.append({"pressure_mbar": pressure, "swing_mm": common.number(1e3 * heights[0], 3), "frequency_hz": common.number(frequency, 4),
                           "damping_ratio": common.number(-math.log(ratio) / math.pi, 2),
                           "youngs_modulus": common.number(beam_modulus(frequency), 4)})
        write_capture(arguments.work / str(pressure), pressure, tip, start)
        if not arguments.fit or fits:
            continue
        choices = {"element": "quadratic_tetrahedra", "cells": 5, "coarse_cells": 4, "poissons_ratio.start": POISSON,
                   "poissons_ratio.estimate": False, "starts": 1}
        figures = common.fit(arguments.program, arguments.work / str(pressure), arguments.work / f"fit-{pressure}", choices,
                             limit=arguments.limit)
        E = figures["result"]["parameters"]["youngs_modulus"]
        fits.append({"pressure_mbar": pressure, "youngs_modulus": common.number(E["value"], 4), "std": common.number(E.get("std"), 2),
                     "marker_rms_mm": common.number(1e3 * (figures["result"]["error"].get("marker_rms") or 0.0), 3),
                     "wall_seconds": figures["wall_seconds"], "stiffness_damping": common.number(figures["result"]["parameters"]["stiffness_damping"]["value"], 3),
                     "mass_damping": common.number(figures["result"]["parameters"]["mass_damping"]["value"], 3),
                     "converged": figures["exit_code"] == 0, "limit": arguments.limit if figures["exit_code"] == common.INTERRUPTED else None})
    common.write_results(__file__, {"authors": AUTHORS, "poisson_ratio": POISSON, "recordings": recordings, "fits": fits})


if __name__ == "__main__":
    main()
