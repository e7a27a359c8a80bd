#!/usr/bin/env python3
"""Real strips of one silicone, filmed from the side as they swing from a clamp, outlines alone: fitted with no choices.

    run.py [PROGRAM] [--only NAME ...] [--work FOLDER]

What is known of the strips is read for judging only: by their first frequencies, as the films show them,
Young's modulus is 65 to 79 kPa for the density that the captures assume, and all are of one material."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

STRIPS = {"silicone-strip-75mm-1": "75 mm", "silicone-strip-100mm-3": "100 mm", "silicone-strip-concave-6": "concave"}
BY_FREQUENCY = (65e3, 79e3)  # [Pa]


def main():
    arguments = common.arguments(__doc__.split("\n")[0], only={"nargs": "*", "default": list(STRIPS)})
    fits = {}
    for name in arguments.only:
        figures = common.fit(arguments.program, common.shared_data() / name, arguments.work / name)
        result = figures["result"]
        E, frames = result["parameters"]["youngs_modulus"], result["error"]["frames"]
        fits[name] = {"strip": STRIPS[name], "verdict": result["verdict"], "youngs_modulus": common.number(E["value"]),
                      "interval_90": [common.number(bound) for bound in E["interval_90"]],
                      "moduli": sum(key.startswith("youngs_modulus@") for key in result["parameters"]) or 1,
                      "surface_rms": common.number(result["error"]["surface_rms"]), "noise": common.number(frames[0]["noise"]),
                      "frames": len(frames), "wall_seconds": figures["wall_seconds"]}
        print(f"{name}: E {fits[name]['youngs_modulus']:.4g} Pa, {fits[name]['moduli']} moduli, {fits[name]['verdict']}, {figures['wall_seconds']:.0f} s", flush=True)
    common.write_results(__file__, {"by_frequency": BY_FREQUENCY, "fits": fits})


if __name__ == "__main__":
    main()
