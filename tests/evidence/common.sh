# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts of this folder. Rows are collected with row(), long output with block(); page() writes the page.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
topic=$(basename "$0" .sh)
commit=$(git rev-parse --short=10 HEAD)
# What is measured: the program and what it reads. A commit that leaves these alone, a document's say, leaves the steps done.
measured=(CMakeLists.txt CMakePresets.json cmake hal vision localisation drivers apps scenes robots)
[ -z "$(git status --porcelain --untracked-files=no -- "${measured[@]}")" ] || commit+="+"
work=$PWD/evidence-runs/$(git ls-tree HEAD -- "${measured[@]}" | sha1sum | cut -c1-10)${commit##*[0-9a-f]}/$topic
pages=docs/evidence # where the page goes
mkdir -p "$work" "$pages"
twocone=$PWD/build/release/twocone
rows=""
blocks=""
unmet=0

say() { echo "evidence $topic: $*" >&2; }

# row WHAT FIGURE TARGET yes|no
row() {
  rows+="| $1 | $2 | $3 | $4 |"$'\n'
  [ "$4" = yes ] || unmet=$((unmet + 1))
  say "$1: $2 (target $3): $4"
}
# block TITLE TEXT: paths are told from the source tree on, here or in the fresh Debian.
block() {
  local text=${2//"$PWD/"/}
  blocks+=$'\n'"### $1"$'\n\n```text\n'"${text//\/root\/twocone\//}"$'\n```\n'
}

# holds EXPRESSION: yes or no
holds() { awk "BEGIN { print ($1) ? \"yes\" : \"no\" }"; }

# TWOCONE_EVIDENCE_SECONDS=N: steps that have not begun by then are left for the next call, which goes on there.
# TWOCONE_EVIDENCE_ONLY=REGEX: only steps of such names are run; what was done before counts all the same.
# step NAME COMMAND...: runs it once for these sources; its output is $work/NAME.log, its status $work/NAME.status
step() {
  local name=$1
  shift
  if [ -f "$work/$name.status" ]; then
    say "$name: done before"
    return
  fi
  if [ -n "${TWOCONE_EVIDENCE_SECONDS:-}" ] && [ "$SECONDS" -ge "$TWOCONE_EVIDENCE_SECONDS" ]; then
    say "$name: not run, the time is up"
    [ -e "$work/$name.log" ] || echo "not run yet: this measurement's time was up" >"$work/$name.log"
    return
  fi
  if [ -n "${TWOCONE_EVIDENCE_ONLY:-}" ] && [[ ! $name =~ $TWOCONE_EVIDENCE_ONLY ]]; then
    [ -e "$work/$name.log" ] || echo "not run yet" >"$work/$name.log" # it may be running elsewhere
    return
  fi
  say "$name ..."
  local status=0
  "$@" >"$work/$name.log" 2>&1 || status=$?
  echo "$commit" >"$work/$name.commit"
  echo "$status" >"$work/$name.status"
}
status_of() { cat "$work/$1.status" 2>/dev/null || echo "not run"; }
passed() { [ "$(status_of "$1")" = 0 ] && echo yes || echo no; }

page() { # page TITLE
  {
    echo "# Evidence: $1"
    echo
    echo "Written by \`./evidence.sh $topic\`, not by hand."
    echo
    echo "| | |"
    echo "|---|---|"
    echo "| commit measured | $(sort -u "$work"/*.commit | tr '\n' ' ')|"
    echo "| date | $(date -u +%Y-%m-%d) |"
    echo "| machine | $(nproc) cores, $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(awk '/MemTotal/ { printf "%.0f GiB", $2 / 1048576 }' /proc/meminfo), $(. /etc/os-release && echo "$PRETTY_NAME") |"
    echo "| program | $($twocone --version) |"
    echo
    echo "| what | figure | target | met |"
    echo "|---|---|---|---|"
    printf '%s' "$rows"
    printf '%s' "$blocks"
  } >"$pages/$topic.md.part"
  mv "$pages/$topic.md.part" "$pages/$topic.md"
  say "$pages/$topic.md written, $unmet not met"
}
