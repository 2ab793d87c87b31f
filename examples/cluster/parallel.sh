#!/bin/sh
# A sweep in shares by GNU parallel, on this machine or, with --sshlogin in PARALLEL, on others:
#
#   cargo xtask sweep --help                       # builds target/debug/sweep
#   export SWEEP="$PWD/target/debug/sweep"
#   examples/cluster/parallel.sh 64 raspberry.toml --seeds 100000 --out "$PWD/sweep"
#   "$SWEEP" merge sweep/runs-*-of-64.csv --out sweep
#
# A share that failed or was stopped goes on where it stood when the same command is given again.
set -eu
shares=$1
shift
seq "$shares" | parallel --will-cite --halt soon,fail=1 \
    "${SWEEP:?name the program: export SWEEP=.../target/debug/sweep}" "$@" --shard "{}/$shares"
