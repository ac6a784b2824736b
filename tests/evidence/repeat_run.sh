#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes a long run from a short one by repeating its frames with new times.
#
#   tests/evidence/repeat_run.sh FROM TO TIMES
#
# Images are hard links; TO is replaced. Frame numbers, sequence numbers, times and wheel angles continue one frame after the
# end of the last repetition. Poses are those of FROM in each repetition, as if the robot were carried back to its start.
set -euo pipefail
if (($# != 3)); then
  echo "usage: $0 FROM TO TIMES" >&2
  exit 2
fi
from=$1 to=$2 times=$3
# The number of frames, and the length of a repetition: the time span of its frames and one mean frame period more.
read -r frames span_s <<<"$(awk -F, 'NR == 2 { first = $2 } NR > 1 { n++; last = $2 } END { printf "%d %.9f", n, (last - first) * n / (n - 1) }' "$from/frames.csv")"
rm -rf "$to"
mkdir -p "$to/lower" "$to/upper"
cp "$from/run.yaml" "$to"

# again TABLE: repeats a CSV with a heading, or a TUM, whose first column is the time
again() {
  mkdir -p "$(dirname "$to/$1")"
  local separator=,
  if [[ $1 == *.tum ]]; then separator=" "; fi
  awk -F "$separator" -v OFS="$separator" -v CONVFMT=%.12g -v frames="$frames" -v span_s="$span_s" -v times="$times" '
    NR == 1 && FS == "," {
      print
      for (i = 1; i <= NF; i++) {
        if ($i == "frame") step[i] = frames
        if ($i ~ /^(|lower_|upper_|host_)t_s$/) step[i] = span_s
        if ($i ~ /_sequence$/ || $i ~ /^(left|right)_rad$/) of_last[i]
      }
      next
    }
    { row[++n] = $0 }
    END {
      if (FS != ",") step[1] = span_s
      # These columns continue from their own last value, with the step of the last row.
      m = split(row[n], last, FS)
      split(row[n - 1], before, FS)
      split(row[1], first, FS)
      for (i in of_last) step[i] = last[i] - first[i] + (last[i] - before[i])
      for (k = 0; k < times; k++)
        for (r = 1; r <= n; r++) {
          $0 = row[r]
          for (i in step) if ($i != "") $i += k * step[i]
          print
        }
    }' "$from/$1" >"$to/$1"
}
(cd "$from" && find . -name '*.csv' -o -name '*.tum') | while read -r table; do again "${table#./}"; done

for view in lower upper; do
  for ((k = 0; k < times; k++)); do
    for ((frame = 0; frame < frames; frame++)); do
      printf '%s/%06d.png\0%s/%06d.png\0' "$from/$view" "$frame" "$to/$view" $((k * frames + frame))
    done
  done
done | xargs -0 -n 2 ln
