#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes a copy of a simulated run as a real robot would have recorded it: no truth in any file, and no simulated effects.
#
#   tests/evidence/as_real.sh FROM TO
#
# Images are hard links; TO is replaced.
set -euo pipefail
from=$1 to=$2
rm -rf "$to"
cp -rl "$from" "$to"
find "$to" \( -name truth.tum -o -name summary.json \) -delete
find "$to" -name '*.csv' | while read -r table; do
  awk -F, -v OFS=, '
    NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^(true_.*|error_m)$/) of_truth[i] }
    NR > 1 { for (i in of_truth) $i = "" }
    { print }' "$table" >"$table.part"
  mv "$table.part" "$table"
done
# Removes the list of all effects, those of each camera, and those of body and cameras.
awk '
  /^[^ ]/ { in_list = 0 }
  /^  [^ ]/ { in_robot = 0 }
  /^effects:$/ { in_list = 1; print "effects:\n  []"; next }
  /^  effects:$/ { in_robot = 1 }
  in_list || in_robot { next }
  { sub(/, effects: \{[^}]*\}/, ""); print }' "$to/run.yaml" >"$to/run.yaml.part"
mv "$to/run.yaml.part" "$to/run.yaml"
