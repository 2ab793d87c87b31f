#!/bin/sh
#SBATCH --job-name=fingertip-sweep
#SBATCH --cpus-per-task=1
#SBATCH --output=%x-%A_%a.log
# A share of a sweep in each task of a Slurm array:
#
#   cargo xtask sweep --help                       # builds target/debug/sweep
#   export SWEEP="$PWD/target/debug/sweep"
#   sbatch --wait --array=1-64 examples/cluster/slurm.sh raspberry.toml --seeds 100000 --out "$PWD/sweep"
#   "$SWEEP" merge sweep/runs-*-of-64.csv --out sweep
#
# The array begins at 1 and has no gaps. Program, scene and folder lie where every node sees them. A task that was
# stopped goes on where it stood when the same array is given again, or some of its tasks with SHARES as it was:
#
#   SHARES=64 sbatch --wait --array=5,9 examples/cluster/slurm.sh raspberry.toml --seeds 100000 --out "$PWD/sweep"
set -eu
array="$SLURM_ARRAY_TASK_MIN-$SLURM_ARRAY_TASK_MAX of $SLURM_ARRAY_TASK_COUNT"
if [ -z "${SHARES-}" ] && [ "$array" != "1-$SLURM_ARRAY_TASK_COUNT of $SLURM_ARRAY_TASK_COUNT" ]; then
    echo "the array has the tasks $array: it begins at 1 and has no gaps, or SHARES says how many there are in all" >&2
    exit 2
fi
exec "${SWEEP:?name the program: export SWEEP=.../target/debug/sweep}" "$@" \
    --shard "$SLURM_ARRAY_TASK_ID/${SHARES:-$SLURM_ARRAY_TASK_COUNT}"
