#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares the numbers that two programs gave, from the work folders of hashes.sh: for each use, the largest change of a
# range, a bearing and a position in sigmas of the first program's answer, and how many verdicts differ.
#   changes.sh OLD_WORK NEW_WORK
set -euo pipefail
old=$1 new=$2
# largest TABLE VERDICT VALUE:SIGMA...: SIGMA may be a variance, var_...
largest() {
  local table=$1
  shift
  paste -d, "$old/$table" "$new/$table" | awk -F, -v pairs="$*" '
    NR == 1 { half = NF / 2; for (i = 1; i <= half; i++) column[$i] = i; n = split(pairs, pair, " "); next }
    { v = column["verdict"]; verdicts += $v != $(v + half)
      for (p = 1; p <= n; p++) {
        split(pair[p], name, ":"); i = column[name[1]]; s = $column[name[2]]
        if ($i == "" || $(i + half) == "" || s == "") continue
        if (name[2] ~ /^var_/) s = sqrt(s)
        change = ($(i + half) - $i) / s; if (change < 0) change = -change
        if (change > most) most = change } }
    END { printf "%.1e sigmas, %d of %d verdicts", most, verdicts, NR - 1 }'
}
for table in $(cd "$old" && find . -name ranges.csv -not -path '*/methods/*' | sed 's|^\./||; s|/ranges.csv$||' | LC_ALL=C sort); do
  [ -f "$old/$table/fixes.csv" ] || continue
  printf '%s: ranges %s; positions %s\n' "$table" "$(largest "$table/ranges.csv" range_m:sigma_range_m bearing_rad:sigma_bearing_rad)" \
    "$(largest "$table/fixes.csv" x_m:var_x_m2 y_m:var_y_m2)"
done
