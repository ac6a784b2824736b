#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares calibrated numbers with the planted ones (plant.sh). Prints a table, and exits with 0 if each planted number was observed and
# lies within its 3 sigma. A number that keeps its prior, or that calibration does not report, is not found. The table also has the
# other numbers.
#   tests/evidence/found.sh TRUTH.json CALIBRATION.json
set -euo pipefail
table=$(jq -rn --slurpfile planted_file "$1" --slurpfile got "$2" '
  $planted_file[0].truth as $truth | [$planted_file[0].planted[][]] as $planted
  | def round3: . * 1000 | round / 1000;
  ($got[0].parameters | map({key: .name, value: .}) | from_entries) as $numbers
  | [ $truth | keys_unsorted[] as $name | $numbers[$name] as $n
      | {name: $name, truth: $truth[$name], is_planted: ($planted | index($name) != null), number: $n,
         off: (if $n != null and $n.sigma > 0 then (($n.after - $truth[$name]) / $n.sigma) else null end)}
      | .is_within = (.number.observed == true and .off != null and (.off | fabs) <= 3)
      | select(.is_planted or .number != null) ] as $rows
  | [$rows[] | select(.is_planted)] as $wanted
  | [$rows[] | select((.is_planted | not) and .number.observed and (.number.derived | not))] as $others
  | [$others[] | select(.is_within | not)] as $beyond
  | ($rows[]
     | (if .is_planted then (if .is_within then "found " else "MISSED" end)
        elif .number.observed != true then "kept  " elif .is_within then "ok    " else "beyond" end)
       + "  \(.name): " + (if .number == null then "no number" else
           "\(.number.before) -> \(.number.after) +- \(.number.sigma), truth \(.truth), off by \((.off // 0) | round3) sigma"
           + (if .number.observed then "" else ", not observed" end) end)),
    "\([$wanted[] | select(.is_within)] | length) of \($wanted | length) planted numbers found, the farthest \([$wanted[].off // 0 | fabs] | max // 0 | round3) sigma off; of \($others | length) others \($beyond | length) beyond 3 sigma"
    + (if $beyond == [] then "" else " (" + ([$beyond[] | "\(.name) \(.off | round3)"] | join(", ")) + ")" end)
    + (if all($wanted[]; .is_within) then "" else "; MISSED " + ([$wanted[] | select(.is_within | not) | "\(.name) \((.off // 0) | round3)"] | join(", ")) end)
')
printf '%s\n' "$table"
case $table in *MISSED*) exit 1 ;; esac
