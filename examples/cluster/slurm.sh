#!/bin/sh
#SBATCH --job-name=fingertip-sweep
#SBATCH --cpus-per-task=1
#SBATCH --output=%x-%A_%a.log
# A share of a sweep in each task of a Slurm array:
#
#   cargo xtask sweep --help                       # builds target/host/sweep
#   export SWEEP="$PWD/target/host/sweep"
#   sbatch --wait --array=1-64 examples/cluster/slurm.sh raspberry.toml --seeds 100000 --out "$PWD/sweep"
#   "$SWEEP" merge sweep/runs-*-of-64.csv --out sweep
#
# The array begins at 1 and has no gaps. Program, scene and folder lie where every node sees them. A task that was
# stopped goes on where it stood when the same array is given again.
set -eu
exec "${SWEEP:?name the program: export SWEEP=.../target/host/sweep}" "$@" \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
