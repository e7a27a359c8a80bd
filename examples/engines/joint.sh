#!/usr/bin/env bash
# One fit of several recordings of one object by the tasks of a Slurm job, in a build with -DPLIANT_WITH_MPI=ON:
#   sbatch --ntasks=4 --cpus-per-task=2 --signal=B:USR1@120 joint.sh A B C D --out DIR
# The folders are on a file system that all nodes share. 120 s before its time is over, and when it is cancelled, the fit
# ends with the best so far; the same command with --resume goes on. PLIANT names the program where it is not in the
# PATH, MPIRUN the launcher, MPIRUN_OPTIONS more of its options.
#SBATCH --job-name=pliant
#SBATCH --open-mode=append
set -uo pipefail

read -ra options <<< "${MPIRUN_OPTIONS:-}"
trap 'kill -USR1 "$process" 2> /dev/null' USR1 INT TERM
"${MPIRUN:-mpirun}" -n "${SLURM_NTASKS:-1}" --bind-to none "${options[@]}" \
  "${PLIANT:-pliant}" fit "$@" --threads "${SLURM_CPUS_PER_TASK:-1}" &
process=$!
while true; do
  wait "$process"
  code=$?
  kill -0 "$process" 2> /dev/null || break # a signal ends the waiting, not the process
done
exit "$code"
