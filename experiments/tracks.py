"""What the experiments with followed nodes share: runs of pliant_tracks, and what is kept of them."""
import subprocess

import common

KEPT = ("nodes", "elements", "start", "parameters", "wall_seconds", "processor_seconds", "iterations", "evaluations", "forward_steps",
        "converged", "reason", "start_cost", "cost", "track_rms", "costs", "history", "stages", "load_at_start")


def run(program, out, choices):
    """One run of pliant_tracks, or its output where it has run already. Returns its figures."""
    if not out.exists():
        part, log = out.with_suffix(".part"), out.with_suffix(".log")
        with open(part, "w") as file, open(log, "w") as messages:
            subprocess.run([program, *(f"{key}={value}" for key, value in choices.items())], check=True, stdout=file, stderr=messages)
        part.rename(out)
    return common.read(out)


def program(arguments):
    return arguments.program.parent.parent / "experiments/pliant_tracks"


def moduli(values):
    return ",".join(f"{E:g}" for E in values)


def errors(figures):
    """Worst relative errors of the moduli and of each damping, and where the worst modulus stands."""
    error = {p["name"]: p["relative_error"] for p in figures["parameters"]}
    of_moduli = {name: e for name, e in error.items() if name.startswith("youngs_modulus")}
    worst = max(of_moduli, key=lambda name: abs(of_moduli[name]))
    return {"worst_modulus": of_moduli[worst], "worst_at": int(worst.split("@")[1]), "mass_damping": error["mass_damping"],
            "stiffness_damping": error["stiffness_damping"]}


def fit(arguments, name, choices):
    """A row of results.json: a fit's figures, judged."""
    figures = run(program(arguments), arguments.work / f"{name}.json", choices)
    row = {"choices": choices, "errors": errors(figures), "motions": figures["motions"], "settings": figures["choices"], **{key: figures[key] for key in KEPT if key in figures}}
    print(name, row["errors"], round(figures["wall_seconds"]), "s", figures["reason"], flush=True)
    return row
