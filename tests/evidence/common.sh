# SPDX-License-Identifier: Apache-2.0
# The scripts of this folder source this file. row() collects rows, block() collects long output, and page() writes the page.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
topic=$(basename "$0" .sh)
commit=$(git rev-parse --short=10 HEAD)
# The measured sources: the program and the files that it reads. A commit that does not change them, for example one of documents,
# does not require a step again.
# A topic sets `sources` before it reads this file if its figures depend on fewer of them, and `also` if on other files as well.
measured=("${sources[@]-}")
[ -n "${measured[0]}" ] || measured=(CMakeLists.txt CMakePresets.json cmake include base hal vision localisation drivers apps scenes robots)
measured+=("${also[@]}")
[ -z "$(git status --porcelain --untracked-files=no -- "${measured[@]}")" ] || commit+="+"
state_of() { git ls-tree "$1" -- "${measured[@]}" | sha1sum | cut -c1-10; } # of a commit's measured sources
state=$(state_of HEAD)
work=$PWD/evidence-runs/$state${commit##*[0-9a-f]}/$topic
pages=docs/evidence # folder of the page
mkdir -p "$work" "$pages"
twocone=$PWD/build/release/twocone
rows=""
blocks=""
unmet=0

report() { echo "evidence $topic: $*" >&2; }

# row WHAT FIGURE TARGET yes|no: removes the path of the source tree from the figure. An empty figure was not run.
row() {
  local figure=${2:-not run}
  rows+="| $1 | ${figure//"$PWD/"/} | $3 | $4 |"$'\n'
  [ "$4" = yes ] || unmet=$((unmet + 1))
  report "$1: $figure (target $3): $4"
}
trim() { sed 's/^ *//; s/ *$//' <<<"$1"; }
# log NAME: prints the log of a step without control characters of the kernel's console.
log() { tr -cd '\11\12\40-\176\200-\377' <"$work/$1.log"; }
# rows NAME: collects the rows of a step's log; a step without rows is not met.
rows() {
  local what figure target met found=no
  while IFS='|' read -r _ what figure target met; do
    found=yes
    row "$(trim "$what")" "$(trim "$figure")" "$(trim "$target")" "$(trim "$met")"
  done < <(log "$1" | grep '^row |')
  [ $found = yes ] || row "$1" "$(log "$1" | tail -n 1)" "figures" no
}
# block TITLE TEXT: removes the path of the source tree, here and in the fresh Debian, from the text.
block() {
  local text=${2//"$PWD/"/}
  blocks+=$'\n'"### $1"$'\n\n```text\n'"${text//\/root\/twocone\//}"$'\n```\n'
}

# holds EXPRESSION: prints yes or no
holds() { awk "BEGIN { print ($1) ? \"yes\" : \"no\" }"; }

# TWOCONE_EVIDENCE_SECONDS=N: no step starts after N seconds; the next call continues with the remaining steps.
# TWOCONE_EVIDENCE_ONLY=REGEX: only steps with matching names run; steps that were done before still count.
# TWOCONE_EVIDENCE_EARLIER=STATE, with ONLY: all other steps are taken from the folder of earlier sources, evidence-runs/STATE. The
# page names all commits, and counts as stale.
if [ -n "${TWOCONE_EVIDENCE_EARLIER:-}" ] && [ -z "$(ls "$work")" ]; then
  again=${TWOCONE_EVIDENCE_ONLY:?names the steps that are not taken from TWOCONE_EVIDENCE_EARLIER}
  cp -r "evidence-runs/$TWOCONE_EVIDENCE_EARLIER/$topic/." "$work"
  for status in "$work"/*.status; do
    [[ ! $(basename "$status" .status) =~ $again ]] || rm "$status"
  done
fi
# step NAME COMMAND...: runs the command once for these sources; its output is $work/NAME.log, its status $work/NAME.status
step() {
  local name=$1
  shift
  if [ -f "$work/$name.status" ]; then
    report "$name: done before"
    return
  fi
  if [ -n "${TWOCONE_EVIDENCE_SECONDS:-}" ] && [ "$SECONDS" -ge "$TWOCONE_EVIDENCE_SECONDS" ]; then
    report "$name: not run, the time limit is reached"
    [ -e "$work/$name.log" ] || echo "not run yet: the time limit was reached" >"$work/$name.log"
    return
  fi
  if [ -n "${TWOCONE_EVIDENCE_ONLY:-}" ] && [[ ! $name =~ $TWOCONE_EVIDENCE_ONLY ]]; then
    [ -e "$work/$name.log" ] || echo "not run yet" >"$work/$name.log" # another call may be running it
    return
  fi
  report "$name ..."
  local status=0
  "$@" >"$work/$name.log" 2>&1 || status=$?
  echo "$commit" >"$work/$name.commit"
  echo "$status" >"$work/$name.status"
}
status_of() { cat "$work/$1.status" 2>/dev/null || echo "not run"; }
passed() { [ "$(status_of "$1")" = 0 ] && echo yes || echo no; }

page() { # page TITLE
  local one
  for one in $(sort -u "$work"/*.commit); do
    [ "$(state_of "${one%+}")" = "$state" ] || state="mixed: some steps were measured on earlier sources"
  done
  {
    echo "# Evidence: $1"
    echo
    echo "Written by \`./evidence.sh $topic\`, not by hand."
    echo
    echo "| | |"
    echo "|---|---|"
    echo "| commit measured | $(sort -u "$work"/*.commit | tr '\n' ' ')|"
    echo "| sources | ${measured[*]} |"
    echo "| their state | $state |"
    echo "| date | $(date -u +%Y-%m-%d) |"
    echo "| machine | $(nproc --all) cores, $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(awk '/MemTotal/ { printf "%.0f GiB", $2 / 1048576 }' /proc/meminfo), $(. /etc/os-release && echo "$PRETTY_NAME") |"
    echo "| program | $($twocone --version) |"
    echo
    echo "| what | figure | target | met |"
    echo "|---|---|---|---|"
    printf '%s' "$rows"
    printf '%s' "$blocks"
  } >"$pages/$topic.md.part"
  mv "$pages/$topic.md.part" "$pages/$topic.md"
  report "$pages/$topic.md written, $unmet not met"
}
