#!/usr/bin/env python3
"""One program in a process of its own: every run of a body, timed, and compared with the fine reference of its law.

Usage: worker.py PROGRAM BODY_FOLDER [--equilibria | --first | --laws]
  --first  of each method, what its first run needs beside its steps, once, so that nothing has been compiled before
  --laws   how far the references of each method are from pliant's own
  Prints one line of JSON. PROGRAM is a module NAME_peer beside this file. References are kept in BODY_FOLDER/references."""
import dataclasses
import importlib
import json
import pathlib
import statistics
import sys

import numpy as np

import bodies
import reference
from measured import Clock, Unreached

FINE_STEP = {"bar": 5e-5}  # [s] of the explicit references
REPETITIONS, LONG_S = 3, 1.5  # what took longer is not repeated
LOST = 1.0  # of the body's size: rms errors beyond are no motion of this body


def rms(a, b):
    """Over nodes and times, of the distance [m]."""
    return float(np.sqrt(((a - b) ** 2).sum(axis=-1).mean()))


def kept(file, make):
    """An array that is made once and kept."""
    if not file.exists():
        file.parent.mkdir(exist_ok=True)
        np.save(file, make())
    return np.load(file)


def reference_file(body, program, peer, method):
    about = peer.METHODS[body.name][method]
    name = f"{program}-{method}".replace(" ", "-") if "finest" in about else f"{about['law']}-{'consistent' if about['consistent'] else 'lumped'}"
    return body.folder / "references" / f"{name}.npy"


def fine(body, program, peer, method):
    """The reference of a method: of its law and masses by the explicit scheme, or, with contact, the program itself at much shorter steps."""
    about, file = peer.METHODS[body.name][method], reference_file(body, program, peer, method)
    if "finest" in about:
        return kept(file, lambda: peer.run(body, method, about["finest"]).positions)
    return kept(file, lambda: reference.motion(body, about["law"], about["consistent"], FINE_STEP[body.name]))


def measured(body, run, against):
    """A run's figures, medians of its repetitions, or why there is none."""
    outcomes = []
    while len(outcomes) < REPETITIONS and sum(o.processor_s for o in outcomes) < LONG_S:
        try:
            outcomes.append(run())
        except Unreached as reason:
            return {"reason": str(reason)}
    error = rms(outcomes[0].positions, against)
    if not error < LOST * np.ptp(body.nodes, axis=0).max():
        return {"reason": "the motion is lost"}
    figures = {key: statistics.median(getattr(o, key) for o in outcomes) for key in ("processor_s", "wall_s", "start_s")}
    return {"steps": outcomes[0].steps, "repetitions": len(outcomes), **figures, "compile_s": outcomes[0].compile_s, "error_m": error}


def motions(body, program, peer):
    out = []
    for method in peer.METHODS.get(body.name, {}):
        against = fine(body, program, peer, method)
        for settings in peer.runs(body.name, method):
            out.append({"method": method, "settings": settings, **measured(body, lambda: peer.run(body, method, settings), against)})
            print(program, body.name, out[-1], file=sys.stderr, flush=True)
    return out


def equilibria(body, peer):
    out = []
    for method, about in getattr(peer, "EQUILIBRIA", {}).items():
        against = kept(body.folder / "references" / f"{about['law']}-equilibrium.npy", lambda: reference.equilibrium(body, about["law"]))
        for settings in [{"increments": n} for n in getattr(peer, "INCREMENTS", ())] or [{}]:
            sag = []

            def run():
                outcome = peer.equilibrium(body, method, settings)
                sag.append(float(np.linalg.norm(outcome.positions[0] - body.nodes, axis=1).max()))
                return outcome
            figures = measured(body, run, against)
            out.append({"method": method, "settings": settings, **figures, **({"sag_m": sag[0]} if sag else {}),
                        "sag_of_reference_m": float(np.linalg.norm(against - body.nodes, axis=1).max())})
            print(body.name, out[-1], file=sys.stderr, flush=True)
    return out


def first_runs(body, peer):
    """What a process that has compiled nothing needs before its steps: seconds of processor."""
    short = dataclasses.replace(body, times=body.times[:1])
    out = []
    for method in peer.METHODS[body.name]:
        outcome = peer.run(short, method, peer.runs(body.name, method)[0])
        out.append({"method": method, "start_s": outcome.start_s, "compile_s": outcome.compile_s})
    return out


def laws(body, program, peer):
    own = reference_file(body, "pliant", importlib.import_module("pliant_peer"), "neo-Hookean")
    return [{"method": method, "apart_m": rms(np.load(reference_file(body, program, peer, method)), np.load(own))} for method in peer.METHODS[body.name]]


def main(program, folder, *options):
    body = bodies.load(pathlib.Path(folder).resolve())
    with Clock() as loading:
        peer = importlib.import_module(f"{program}_peer")
    out = {"version": peer.version(), "import_s": loading.processor_s, "nodes": len(body.nodes), "elements": len(body.elements)}
    if "--first" in options:
        out["runs"] = first_runs(body, peer)
    elif "--laws" in options:
        out["runs"] = laws(body, program, peer)
    else:
        out["runs"] = equilibria(body, peer) if "--equilibria" in options else motions(body, program, peer)
    print(json.dumps(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
