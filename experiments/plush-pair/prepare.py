#!/usr/bin/env python3
"""Two frames of a plush dog that a hand moves: frame 50 gives its rest surface, both are the capture.

Makes in --work (default: build/captures/plush-pair):
  scan/   frame 50 without a surface; scan/rest/ is what `pliant scan` makes of it
  move/   frames 50 and 51

Images and the owners' masks stay where they are. All of the dog's back is a guess, and so is
its density."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent)]
import rest_captures as rc

DENSITY = 60           # kg/m^3, of a stuffed toy
SIZE, PINHOLE = (640, 480), (517.0, 517.0, 320.0, 240.0)
UP = [0.0, -0.87, -0.5]  # about; the scan finds the ground's normal


def main():
    arguments = rc.arguments(__doc__, "plush-pair")
    work, data = arguments.work, rc.shared_data() / "plush-depth-pair"

    def camera(folder):
        return rc.depth_camera("kinect", SIZE, PINHOLE, rc.pattern(folder, data, "snoopy_depth_00005%d.png"),
                               rc.pattern(folder, data, "snoopy_omask_00005%d.png"))

    scan, move = work / "scan", work / "move"
    rc.write_capture(scan, "a plush dog", camera(scan), 2, UP)
    found = rc.scan(arguments.program, scan)
    rc.write_capture(move, "a plush dog moved by hand", camera(move), 2, found["plane"]["normal"],
                     surface=scan / "rest/rest.ply", density=DENSITY, plane=found["plane"])
    rc.check(arguments.program, move)


if __name__ == "__main__":
    main()
