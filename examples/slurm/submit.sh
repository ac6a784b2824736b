#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A sweep of `twocone tradeoff` on a Slurm cluster: an array of shards, then a job that merges them.
#   submit.sh ROBOT OUT [SWEEP OPTION...] [-- MERGE OPTION...]
#   submit.sh robots/lab_sim.yaml /shared/lab --fine --seed 2 -- --target-mm 5
# All nodes must see OUT, ROBOT and the files that ROBOT names under the same path. A second call computes only missing shards.
#   TWOCONE               the program; default: twocone of PATH
#   TWOCONE_ARRAY_TASKS   greatest number of tasks of the array; default 1000: clusters refuse more than MaxArraySize - 1
#   SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT ...   as in sbatch
# Prints the numbers of both jobs.
set -euo pipefail

if (($# < 2)); then
  sed -n '3,5p' "$0" | sed 's/^# *//' >&2
  exit 2
fi
robot=$1
out=$(realpath -m "$2")
shift 2
sweep=()
while (($#)) && [ "$1" != -- ]; do
  sweep+=("$1")
  shift
done
if (($#)); then shift; fi
choice=("$@")

TWOCONE=$(command -v "${TWOCONE:-twocone}") || { echo "submit.sh: no twocone in PATH; set TWOCONE to its path" >&2; exit 1; }
TWOCONE=$(realpath "$TWOCONE")
export TWOCONE
shards=$("$TWOCONE" tradeoff --robot "$robot" "${sweep[@]}" --shards)
tasks=$((shards < ${TWOCONE_ARRAY_TASKS:-1000} ? shards : ${TWOCONE_ARRAY_TASKS:-1000}))
mkdir -p "$out/logs"

array=$(sbatch --parsable --array="0-$((tasks - 1))" --output="$out/logs/task-%A_%a.log" \
  "$(dirname "$(realpath "$0")")/tradeoff.sbatch" "$shards" "$tasks" "$robot" "$out" "${sweep[@]}")
array=${array%%;*} # on some clusters "NUMBER;CLUSTER"
quoted=$(printf ' %q' "$TWOCONE" tradeoff --robot "$robot" --out "$out" "${sweep[@]}" --merge "${choice[@]}")
merge=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --job-name=twocone-merge \
  --output="$out/logs/merge-%j.log" --wrap="exec$quoted")
echo "$shards shards in $tasks tasks: job $array; merge: job ${merge%%;*}; results and logs: $out"
