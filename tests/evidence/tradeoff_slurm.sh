#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the same sweep by Slurm (examples/slurm, on a cluster of one node): errors.csv must be byte-equal to that of WHOLE.
#   tradeoff_slurm.sh TWOCONE FOLDER ROBOT EPISODES WHOLE
set -euo pipefail
twocone=$1 folder=$2 robot=$3 episodes=$4 whole=$5
cd "$(dirname "$0")/../.."
. tests/evidence/slurm_node.sh
rm -rf "$folder"
trap stop_slurm EXIT
start_slurm
echo "$(sinfo --version), $(scontrol show node | grep -o 'CPUTot=[0-9]*')"
TWOCONE=$twocone examples/slurm/submit.sh "$robot" "$folder" --episodes "$episodes" | tee "$folder.jobs"
array=$(sed -n 's/.* tasks: job \([0-9]*\);.*/\1/p' "$folder.jobs")
merge=$(sed -n 's/.*merge: job \([0-9]*\);.*/\1/p' "$folder.jobs")
begin=$SECONDS
echo "array: $(wait_for_job "$array" 3600 || { tail -n 2 "$folder"/logs/task-*.log && exit 1; })"
echo "merge: $(wait_for_job "$merge" 600 || { tail -n 5 "$folder/logs/merge-$merge.log" && exit 1; })"
cmp "$whole/errors.csv" "$folder/errors.csv"
echo "byte-equal: errors.csv after $(find "$folder/logs" -name 'task-*' | wc -l) tasks of an array and a merge, $((SECONDS - begin)) s"
