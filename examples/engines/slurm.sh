#!/usr/bin/env bash
# `pliant batch` or `pliant ensemble` in parts, as the tasks of a Slurm job array:
#   sbatch --array=1-50 slurm.sh batch 'recordings/*' --out fits
#   sbatch --array=1-50 slurm.sh ensemble fit --members 5000 --out many
# The folder after --out is on a file system that all nodes share. Tasks may start in any order, be killed and be
# queued again; the same command once more goes on with what is left. The last task to end finds all of them ended, and
# gathers. PLIANT names the program where it is not in the PATH.
#SBATCH --job-name=pliant
#SBATCH --cpus-per-task=2
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:INT@120
set -uo pipefail

pliant="${PLIANT:-pliant}"
cores="${SLURM_CPUS_PER_TASK:-1}"
# A fit uses all cores of its task; of an ensemble each has members of its own.
if [[ "${1:-}" == ensemble ]]; then shares=(--workers "$cores"); else shares=(--workers 1 --threads "$cores"); fi

# 120 s before its time is over, and when it is cancelled, a task leaves its work to others.
trap 'kill -INT "$process" 2> /dev/null' INT TERM
"$pliant" "$@" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" "${shares[@]}" &
process=$!
while true; do
  wait "$process"
  code=$?
  kill -0 "$process" 2> /dev/null || break # a signal ends the waiting, not the process
done

# 3: other tasks have not ended yet, or something did not converge, which the table says: nothing is wrong with this task.
[[ $code -eq 3 ]] && exit 0
exit "$code"
