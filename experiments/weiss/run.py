#!/usr/bin/env python3
"""The evaluation of Weiss et al. 2020 (its figures 3, 7, 9 to 11 and 18 to 31) on synthetic recordings.

Every recording is simulated on a finer grid and with shorter steps than it is fitted with. Each study writes its part of
results.json; what has run already, in the folder of --work, is not run again."""
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import studies


def complaints(name, found):
    """What is wrong with a small study: starts that do not reach the truth, derivatives that point away from it."""
    for case, row in found.items() if isinstance(found, dict) else []:
        if name in ("views", "resolutions", "bands", "grounds", "bodies") and row["reached"] != row["starts"]:
            yield f"{name}, {case}: {row['reached']} of {row['starts']} starts reach the truth"
        if name in ("steps", "widths", "costs", "difference-gradients") and "field" not in case and (row["wrong_signs"] or row["failed"]):
            yield f"{name}, {case}: the derivative points away from the truth at {row['wrong_signs']}, {row['failed']} failed"
    if name == "optimisers":
        yield from (f"{name}, {case}: {run['reason']}" for case, runs in found.items() for run in runs if not run["succeeded"] or run["cost"] >= run["costs"][0] * 1.001)


def main():
    arguments = common.arguments(__doc__, only={"help": "names of studies, with commas; left out: all of " + ", ".join(studies.ALL)},
                                 small={"action": "store_true", "help": "one start and few frames of each, to see that it runs; writes no results"})
    names = arguments.only.split(",") if arguments.only else list(studies.ALL)
    unknown = [name for name in names if name not in studies.ALL]
    if unknown:
        sys.exit(f"there is no study \"{unknown[0]}\"; there are {', '.join(studies.ALL)}")
    study = studies.Study(arguments.program, arguments.work, arguments.small)
    wrong = []
    for name in names:
        found = studies.ALL[name](study)
        if arguments.small:
            wrong += complaints(name, found)
        else:
            path = HERE / "results.json"
            before = common.read(path)["studies"] if path.exists() else {}
            common.write_results(__file__, {"studies": before | {name: found}})
    if arguments.small:
        shutil.rmtree(arguments.work, ignore_errors=True)
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
