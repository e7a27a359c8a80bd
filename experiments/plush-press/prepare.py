#!/usr/bin/env python3
"""The knobbly ball that a hand presses, as captures with a rest surface made of the frames before the first touch.

Makes in --work (default: build/captures/plush-press):
  scan/   the first 36 frames without a surface; scan/rest/ is what `pliant scan` makes of them
  press/  frames 0 to 249: at rest to 35, pressed by a hand from about 40
  after/  frames 800, 820 ... 960: the ball at rest again, turned and moved on the table; nine looks at one shape

Images stay where they are. The owners' masks take in hands, and in `press` lag behind by some pixels; its masks are made
anew instead: readings above the table within REACH of the box of the ball at rest. Fingers on the ball are in them, the
bear and most of the arm are not. Density is a guess."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent)]
import png
import rest_captures as rc

UNTOUCHED = 36         # frames
DENSITY = 150          # kg/m^3, of a soft foamed toy
REACH = 0.025          # [m]; the bear's arm is 40 mm away
SIZE, PINHOLE = (320, 240), (275.0, 275.0, 160.0, 120.0)
UP = [-0.017, -0.867, -0.498]  # about; the scan finds the table's normal


def camera(images, masks):
    return rc.depth_camera("table", SIZE, PINHOLE, images, masks)


def main():
    arguments = rc.arguments(__doc__, "plush-press")
    work, data = arguments.work, rc.shared_data() / "plush-press-rgbd"

    scan = work / "scan"
    sensors = camera(rc.pattern(scan, data, "depth/%06d.png"), rc.pattern(scan, data, "mask_ball/%06d.png"))
    rc.write_capture(scan, "a knobbly ball at rest", sensors, UNTOUCHED, UP, static=True)
    found = rc.scan(arguments.program, scan)
    surface = scan / "rest/rest.ply"
    world = {"up": found["plane"]["normal"], "plane": found["plane"], "density": DENSITY, "surface": surface}

    press = work / "press"
    box = rc.box_of(rc.vertices(surface), REACH)
    for frame in range(250):
        mask = rc.mask_of_box(png.read_depth(data / f"depth/{frame:06d}.png"), PINHOLE, box, found["plane"])
        rc.write_mask(press / f"mask/{frame:06d}.png", SIZE[0], mask)
    sensors = camera(rc.pattern(press, data, "depth/%06d.png"), "mask/%06d.png")
    rc.write_capture(press, "a knobbly ball pressed by hand", sensors, 250, start=UNTOUCHED, **world)

    after = work / "after"
    later = range(800, 961, 20)
    for i, frame in enumerate(later):
        rc.refer(after / f"depth/{i:06d}.png", data / f"depth/{frame:06d}.png")
        rc.refer(after / f"mask/{i:06d}.png", data / f"mask_ball/{frame:06d}.png")
    sensors = camera("depth/%06d.png", "mask/%06d.png")
    rc.write_capture(after, "a knobbly ball after it was pressed", sensors, len(later), static=True, **world)

    for capture in (press, after):
        rc.check(arguments.program, capture)


if __name__ == "__main__":
    main()
