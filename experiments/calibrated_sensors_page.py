"""The section on sensors that were badly calibrated."""
from page import machine, percent, results, table


def calibrated_sensors():
    figures = results("calibrated-sensors")
    if not figures:
        return "Not run yet.\n"
    rows = []
    for name, s in figures["sensors"].items():
        lens = s["true_distortion"][:2]
        found = s["distortion"][:2]
        rows.append([name, f"{s['turned']:.2f} / {1e3 * s['moved']:.1f}", f"{s['pose_error_deg']:.3f} / {1e3 * s['pose_error']:.2f}",
                     f"{1e3 * s['time_offset']:.2f} ({1e3 * s['true_time_offset']:.0f})",
                     (", ".join(f"{k:.3f}" for k in found) or "none") + (f" ({', '.join(f'{k:.2f}' for k in lens)})" if lens else " (none)"),
                     f"{1e3 * s['rms_before']:.2f} / {1e3 * s['rms_after']:.2f}"])
    text = "By the ball, with the first camera as the reference:\n\n" + table(
        ["camera", "pose corrected by [degrees] / [mm]", "off the truth after that", "time offset [ms] (truth)", "k1, k2 (truth)", "centres off the reference's path before / after, rms [mm]"], rows)
    truth = figures["truth"]
    names = {"stated": "as they were stated", "calibrated": "calibrated by the ball", "true": "as they are"}
    rows = []
    for name, f in figures["fits"].items():
        E = truth["youngs_modulus"]
        rows.append([names[name], f"{f['youngs_modulus']:.0f} ± {f['std']:.2g}", percent(f["youngs_modulus"] / E - 1), f"{f['mass_damping']:.3g}", f"{1e3 * f['stiffness_damping']:.2f}",
                     f"{1e3 * f['surface_rms']:.2f}", f"{f['wall_seconds']:.0f}", "yes" if f["converged"] else "no"])
    text += (f"\nFits of the ring; truth: E {truth['youngs_modulus']:.0f} Pa, mass damping {truth['mass_damping']:.2g} 1/s, stiffness damping {1e3 * truth['stiffness_damping']:.1f} ms:\n\n"
             + table(["cameras", "E [Pa]", "off the truth", "mass damping [1/s]", "stiffness damping [ms]", "surface rms [mm]", "time [s]", "converged"], rows))
    return text + f"\nMeasured on {machine(figures)}.\n"
