#!/usr/bin/env python3
"""`pliant batch` or `pliant ensemble` in parts, as tasks of Dask:

    dask_parts.py --parts 50 --workers 8 -- ensemble fit --members 5000 --out many
    dask_parts.py --parts 50 --scheduler tcp://head:8786 -- batch 'recordings/*' --out fits

Without --scheduler the workers are processes of this machine. The folder after --out is on a file system that all workers
share, and so is what the command names. A task whose worker is lost runs on another one, and goes on with what is left.
"""

import argparse
import subprocess
import sys

from dask.distributed import Client, LocalCluster, as_completed

NOT_ALL_CONVERGED = 3


def run(words):
    """Runs the program; its exit code and what it said."""
    done = subprocess.run(words, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=int, required=True)
    parser.add_argument("--workers", type=int, default=1, help="of this machine, where there is no scheduler")
    parser.add_argument("--scheduler", help="address of one")
    parser.add_argument("--cores", type=int, default=1, help="that a part uses")
    parser.add_argument("--pliant", default="pliant", help="the program")
    parser.add_argument("command", nargs="+", help="after --: batch or ensemble, with its arguments")
    choices = parser.parse_args()
    # A fit uses all cores of its part; of an ensemble each has members of its own.
    if choices.command[0] == "ensemble":
        shares = ["--workers", str(choices.cores)]
    else:
        shares = ["--workers", "1", "--threads", str(choices.cores)]
    words = [choices.pliant, *choices.command, *shares]

    cluster = None if choices.scheduler else LocalCluster(n_workers=choices.workers, threads_per_worker=1,
                                                          dashboard_address=None)
    with Client(choices.scheduler or cluster) as client:
        parts = [client.submit(run, words + ["--shard", f"{part}/{choices.parts}"], key=f"pliant-{part}", pure=False, retries=3)
                 for part in range(1, choices.parts + 1)]
        for future, (code, said) in as_completed(parts, with_results=True):
            print(f"{future.key}: {said.strip() or 'nothing said'}", file=sys.stderr)
            # 3: other parts have not ended yet, or something did not converge, which is told below.
            if code not in (0, NOT_ALL_CONVERGED):
                sys.exit(code)
    if cluster:
        cluster.close()
    sys.exit(subprocess.run(words).returncode)  # gathers, where the last part has not


if __name__ == "__main__":
    main()
