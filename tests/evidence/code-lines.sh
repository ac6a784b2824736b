#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Lines of code of each folder, before and after the code was reorganised. cloc counts neither comments nor blank lines.
sources=(include base hal vision localisation drivers apps)
. "$(dirname "$0")/common.sh"
before_commit=0f2c144
rm -rf "$work/before"
mkdir "$work/before"
git archive "$before_commit" | tar -x -C "$work/before"
lines_of() { cloc --quiet --csv --include-lang='C++,C/C++ Header' "$@" | sed -n 's/.*SUM,.*,\([0-9]*\)$/\1/p'; }
within() { for folder in "${sources[@]}"; do [ ! -d "$1/$folder" ] || echo "$1/$folder"; done; }

step before lines_of $(within "$work/before")
step now lines_of "${sources[@]}"
before=$(cat "$work/before.log")
after=$(cat "$work/now.log")
row "lines of code of ${sources[*]}" "$before before ($before_commit), $after now: $(awk "BEGIN { printf \"%.1f\", 100 * (1 - $after / $before) }") % fewer" \
  "at least 10 % fewer" "$(holds "$after <= 0.9 * $before")"
# A folder is large if it holds more than 25 files; then it needs folders inside.
large=""
while read -r count folder; do
  if ((count > 25)) && [ -z "$(git ls-files "$folder" | grep "^$folder/.*/" | grep -v '/CMakeLists.txt$')" ]; then large+="$folder ($count) "; fi
done < <(git ls-files "${sources[@]}" | sed 's|/[^/]*$||' | sort | uniq -c)
row "folders of more than 25 files without folders inside" "${large:-none}" none "$([ -z "$large" ] && echo yes || echo no)"

table=$(printf '%-28s %8s %8s\n' folder before now
  for folder in "${sources[@]}" drivers/* apps/*; do
    [ -d "$folder" ] || [ -d "$work/before/$folder" ] || continue
    was=$([ -d "$work/before/$folder" ] && lines_of "$work/before/$folder" || true)
    is=$([ -d "$folder" ] && lines_of "$folder" || true)
    printf '%-28s %8s %8s\n' "$folder" "${was:--}" "${is:--}"
  done)
block "Each folder" "$table"
page "lines of code"
