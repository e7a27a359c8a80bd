"""The section of docs/experiments.md about exported models in other programs. Standard library only."""
from page import machine, percent, results, table

WORDS = {"calculix": "CalculiX", "mujoco": "MuJoCo", "newton": "Newton, vertex block descent", "gmsh": "Gmsh's file, by", "usd": "USD", "febio": "FEBio,",
         "sofa": "SOFA,", "ply": "frames as PLY, by", "obj": "frames as OBJ, by", "vtu": "frames as VTU, by"}


def off(seen, own):
    return percent(seen / own - 1)


def exports():
    figures = results("exports")
    if not figures:
        return "Not run yet.\n"
    rows, read = [], []
    for name, formats in figures["models"].items():
        for to, f in formats.items():
            seen = f["seen"]
            if "frequencies" not in seen:
                of = [f"{seen[k]} of {f[k]}" if k in f else f"{seen[k]}" for k in ("nodes", "elements")]
                read.append([name, f"{WORDS[to]} {seen['version']}", *of,
                             "; ".join(f"{seen[k]} {k}" for k in ("held", "inverted", "materials", "moduli", "frames", "mm moved at most") if k in seen)])
                continue
            own, model = f["exported"], f["model"]
            pairs = list(zip(seen["frequencies"], own["frequencies"]))
            rows.append([name, f"{WORDS[to]} {seen['version']}", f"{f['elements']} {'quadratic' if f['quadratic'] else 'linear'}", f"{f['moduli_were_multiplied_by']:.3g}",
                         f"{model['frequencies'][0]:.4g}", f"{seen['frequencies'][0]:.4g} ({off(*pairs[0])})",
                         percent(max(abs(a / b - 1) for a, b in pairs[1:]), False) if pairs[1:] else "",
                         percent(max(abs(a / b - 1) for a, b in zip(own["frequencies"][1:], model["frequencies"][1:])), False),
                         f"{1e3 * model['sag']:.4g}", f"{1e3 * seen['sag']:.4g} ({off(seen['sag'], own['sag'])})" if seen["sag"] else "",
                         f"{seen['ms_per_step']:.0f}" if "ms_per_step" in seen else ""])
    text = ("Each model was written by `pliant export` and run by the other program. Frequencies and sags there stand beside pliant's own of the same mesh; moduli are multiplied by one number, so that the first frequency "
            "is the model's. What other elements leave of the further frequencies stands in a column of its own.\n\n")
    text += table(["model", "program", "tetrahedra", "moduli times", "first frequency of the model [Hz]", "in the program (off)", "further ones off, at most", "mesh: further ones off the model's, at most",
                   "sag of the model [mm]", "in the program (off what was exported)", "step [ms]"], rows)
    if read:
        text += "\nFiles that were read, and what was found:\n\n" + table(["model", "read by", "nodes", "elements", ""], read)
    text += ("\nCalculiX solves the linear problems that pliant told: they agree. MuJoCo and Newton swing from rest under a hundredth of gravity and under what makes 25 mm of sag; half of the first maximum is told as the sag, which damping makes too "
             "small, and half a period is told by when it comes, which is between two periods where two first frequencies lie close, as those of release-02 do. Both were run over coarser meshes (`--cells 32`) than the "
             "program would choose, since their steps are slow on a processor: hence their columns of what the mesh leaves. Newton runs by the scene that is exported, without damping. FEBio and SOFA are in no package "
             "registry: their files were read and counted, not run.\n")
    return text + f"\nMeasured on {machine(figures)}.\n"
