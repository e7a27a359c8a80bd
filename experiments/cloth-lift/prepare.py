#!/usr/bin/env python3
"""Two cloths lifted by one corner, as clouds: a slab around a late cloud, and the recording run backwards.

Makes in --work (default: build/captures/cloth-lift), for each of `paper` and `polka`:
  NAME-scan/   the clouds without a surface; NAME-scan/rest/ is what `pliant scan --thickness` makes of the first one
  NAME/        frames 20 or 24 back to 8

Backwards, because the clouds hold only what the robot has lifted off the table: forwards, material appears that no rest
surface of an early frame has, backwards it only goes out of sight. Frames 0 to 7 show little or something else.

A sheet of paper or cloth is a fifth of a millimetre thick, a slab that a grid can hold several: THICKNESS stands for it,
and density is lowered so that the mass stays. Bending stiffness goes with the cube of thickness, so moduli fitted to
the slab are the slab's. The slab is as the cloth hung, which is not its shape free of load."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent)]
import rest_captures as rc

FIRST, LAST = 8, {"paper": 20, "polka": 24}  # later the paper's lower half is lost to the cameras
THICKNESS = 0.008      # [m]
MASS_OF_AREA = 0.15    # kg/m^2, a guess
SENSORS = {"cloud": [{"points": "clouds/%03d.ply", "noise": 0.003}]}


def main():
    arguments = rc.arguments(__doc__, "cloth-lift")
    data = rc.shared_data() / "cloth-lift-cloud"
    for name, last in LAST.items():
        frames = range(last, FIRST - 1, -1)
        scan, lift = arguments.work / f"{name}-scan", arguments.work / name
        for folder in (scan, lift):
            for i, frame in enumerate(frames):
                rc.refer(folder / f"clouds/{i:03d}.ply", data / f"lift_{name}/{frame:03d}.ply")
        world = {"up": [0.0, 0.0, 1.0], "frame_rate": 1.0}
        rc.write_capture(scan, f"a cloth ({name})", SENSORS, len(frames), **world)
        rc.scan(arguments.program, scan, "--thickness", THICKNESS)
        rc.write_capture(lift, f"a cloth ({name}) let down", SENSORS, len(frames), surface=scan / "rest/rest.ply",
                         density=MASS_OF_AREA / THICKNESS, **world)
        rc.check(arguments.program, lift)


if __name__ == "__main__":
    main()
