#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Computes fixes of a run again from its stored frames, each frame in a separate program (cold), and compares them with those of the
# run (warm).
#   tests/evidence/cold.sh TWOCONE RUN METHOD TOLERANCE_M [EVERY]     EVERY: distance of the compared frames, default 30
set -euo pipefail
twocone=$1 run=$2 method=$3 tolerance_m=$4 every=${5:-30}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
frames=$(awk -F, 'FNR > 1 { n++ } END { print n + 0 }' "$run/frames.csv")
compared=0
worst=0
# Each run folder holds only frame k.
for ((k = 0; k < frames; k += every)); do
  one=$work/one
  rm -rf "$one"
  mkdir -p "$one/lower" "$one/upper"
  cp "$run/run.yaml" "$one/"
  name=$(printf '%06d' "$k")
  cp "$run/lower/$name.png" "$one/lower/000000.png"
  cp "$run/upper/$name.png" "$one/upper/000000.png"
  awk -F, -v OFS=, -v k="$k" 'FNR == 1 { print } FNR > 1 && $1 == k { $1 = 0; print }' "$run/frames.csv" >"$one/frames.csv"
  cp "$run/drive.csv" "$one/"
  for pose in truth odometry; do if [ -f "$run/$pose.tum" ]; then sed -n "$((k + 1))p" "$run/$pose.tum" >"$one/$pose.tum"; fi; done
  "$twocone" localise "$one" --method "$method" >/dev/null
  # A frame has one row, or two where the answer is ambiguous. Columns: frame,t_s,verdict,x_m,y_m,heading_rad,...
  awk -F, 'FNR > 1 { print $3, $4, $5 }' "$one/methods/$method/fixes.csv" >"$work/cold"
  awk -F, -v k="$k" 'FNR > 1 && $1 == k { print $3, $4, $5 }' "$run/methods/$method/fixes.csv" >"$work/warm"
  off=$(paste -d' ' "$work/cold" "$work/warm" | awk '
    NF != 6 && NF != 2 { print "rows differ: " $0; exit }
    NF == 2 && $1 != $2 { print "verdicts differ: " $0; exit }
    NF == 6 { if ($1 != $4) { print "verdicts differ: " $0; exit }
              d = sqrt(($2 - $5) ^ 2 + ($3 - $6) ^ 2); if (d > most) most = d }
    END { printf "%.3g\n", most }' | head -n 1)
  case $off in
    [0-9]*) ;;
    *) echo "frame $k: $off"; exit 1 ;;
  esac
  worst=$(awk "BEGIN { print ($off > $worst) ? $off : $worst }")
  compared=$((compared + 1))
done
echo "$compared of $frames frames computed separately: $worst m at most from the run's fix"
awk "BEGIN { exit !($compared > 0 && $worst <= $tolerance_m) }"
