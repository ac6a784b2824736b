#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Kills (-9) and interrupts programs that write, at random moments of a fixed seed. After each: no table has fewer rows than
# before, and each that is there is a beginning of the unbroken one's, or wholly an old or a new one. What can be gone on with is
# gone on with, killed again on the way, and equals in the end what was never broken.
#   kill_trial.sh TWOCONE SOURCE_DIR
# TWOCONE_KILLS=N: so many kills and as many interrupts (4 unless given). TWOCONE_KILL_WHAT: of these commands, in turn
# ("run localise" unless given; all: "run localise calibrate compare tradeoff"). TWOCONE_KILL_FOLDER: works there and keeps it, and
# goes on there when it is called again.
. "$(dirname "$0")/common.sh"
times=${TWOCONE_KILLS:-4}
read -r -a commands <<<"${TWOCONE_KILL_WHAT:-run localise}"
folder=${TWOCONE_KILL_FOLDER:-$work/trial}
frames=8
[[ " ${commands[*]} " =~ \ (calibrate|compare)\  ]] && frames=24 # a rig is not found from fewer
mkdir -p "$folder"
cd "$folder" || exit 1
touch done.txt finished.txt

# Cameras that draw random numbers and lose frames; a tradeoff of it has ideal ones.
small=$source_dir/tests/end_to_end/data/small.yaml
sed "s|\.\./\.\./\.\.|$source_dir|" "$small" >ideal.yaml.new
sed 's|encoder_counts_per_turn: 1024|&, camera: {full_well_electrons: 20000, read_noise_electrons: 3, drop_probability: 0.1, late_probability: 0.1}|' \
  ideal.yaml.new >noisy.yaml.new
for robot in ideal noisy; do cmp -s "$robot.yaml.new" "$robot.yaml" || mv "$robot.yaml.new" "$robot.yaml"; done

now_ms() { echo $(($(date +%s%N) / 1000000)); }
# A signal that is ignored when a program starts, as a shell's background jobs ignore SIGINT, may stay so.
as_from_a_terminal() { exec env --default-signal=INT,TERM,HUP "$@"; }
tables() { (cd "$1" && find . -name '*.csv' -o -name '*.tum' | grep -v '/\.[a-z]*\.\(new\|old\)/' | sort); }
whole_lines() { grep -c '' <"$1"; }
tables_of_results="ranges.csv fixes.csv sightings.csv estimate.tum track.csv"

run_command() {
  if [ -e cut/run.yaml ]; then set -- run --resume cut; else set -- run --robot noisy.yaml --frames $frames --seed 5 --out cut; fi
  printf '%s\n' "$@"
}
method=full
localise_command() { printf '%s\n' localise localised --method $method; }
calibrate_command() { printf '%s\n' calibrate whole --frames 12 --out calibrated/robot.yaml --force; }
compare_command() { printf '%s\n' compare whole localised --frames 12 --no-page --out compared; }
tradeoff_command() { printf '%s\n' tradeoff --robot ideal.yaml --legs 3 --out swept; }

# What each command does when it is left alone, and how long that takes: NAME.ms
timed() { # NAME COMMAND...
  local name=$1 began
  shift
  began=$(now_ms)
  "$twocone" "$@" >"$name.out" 2>"$name.err" || { fail "$name, left alone: $(cat "$name.err")"; finish; }
  echo $(($(now_ms) - began)) >"$name.ms"
}
if [ ! -e ready ]; then
  rm -rf whole cut localised reference calibrated compared swept
  mkdir -p reference calibrated
  timed run run --robot noisy.yaml --frames $frames --seed 5 --out whole
  cp -r whole localised
  for method in paper full; do
    mapfile -t words < <(localise_command)
    timed localise "${words[@]}"
    cp -r "localised/methods/$method" "reference/$method"
  done
  for command in calibrate compare; do
    [[ " ${commands[*]} " == *" $command "* ]] || continue
    mapfile -t words < <("${command}_command")
    timed $command "${words[@]}"
  done
  cp -r calibrated reference/calibrated
  [ -e compared ] && mv compared/compare.json reference/ && rm -rf compared
  echo 15000 >tradeoff.ms # a sweep is never waited for
  touch ready
fi

# State before a command, and what may not be said of it afterwards.
declare -A lines
remember_tables() { # FOLDER
  lines=()
  [ -d "$1" ] || return
  local table
  for table in $(tables "$1"); do lines[$table]=$(whole_lines "$1/$table"); done
}
check_tables() { # FOLDER WHAT
  local table
  for table in "${!lines[@]}"; do
    [ -e "$1/$table" ] || { fail "$2: $table is gone"; continue; }
    (($(whole_lines "$1/$table") >= lines[$table])) || fail "$2: $table had ${lines[$table]} lines, and has $(whole_lines "$1/$table")"
  done
}
# Whole lines but for what tells of the machine: effort.csv, and the clock in frames.csv.
beginning_of_whole() { # TABLE: of cut, is it a beginning of that of whole?
  local n
  n=$(tr -cd '\n' <"cut/$1" | wc -c)
  case $1 in
    */effort.csv) return 0 ;;
    */frames.csv) cmp -s <(head -n "$n" "cut/$1" | cut -d, -f1-9) <(head -n "$n" "whole/$1" | cut -d, -f1-9) ;;
    *) cmp -s <(head -n "$n" "cut/$1") <(head -n "$n" "whole/$1") ;;
  esac
}

before_run() { remember_tables cut; }
after_run() { # WHAT
  check_tables cut "$1"
  [ -e cut ] || return
  local table
  for table in $(tables cut); do beginning_of_whole "$table" || fail "$1: $table is not as in the unbroken run"; done
  grep -qs '^finished: true' cut/run.yaml || return
  for table in $(tables whole); do
    [ "$(wc -l <"cut/$table")" = "$(wc -l <"whole/$table")" ] || fail "$1: it is finished, but $table has fewer lines"
  done
  local picture
  for picture in whole/*/*.png; do cmp -s "$picture" "cut/${picture#whole/}" || fail "$1: $picture differs"; done
  echo "run finished equal" >>finished.txt
  rm -rf cut
}

before_localise() {
  method=$([ $((RANDOM % 2)) = 0 ] && echo paper || echo full)
  remember_tables localised/methods
}
same_results() { # FOLDER METHOD
  local table
  for table in $tables_of_results; do
    if [ -e "reference/$2/$table" ]; then cmp -s "reference/$2/$table" "$1/$table" || return 1; else [ ! -e "$1/$table" ] || return 1; fi
  done
}
after_localise() {
  if compgen -G 'localised/methods/*/.exchange' >/dev/null || compgen -G 'localised/methods/.*/.exchange' >/dev/null; then
    echo "localise: a journal was left" >>finished.txt
    "$twocone" report localised >/dev/null 2>errors || fail "$1: report after it: $(cat errors)"
  fi
  check_tables localised/methods "$1"
  local name
  for name in paper full; do same_results "localised/methods/$name" $name || fail "$1: methods/$name is a mixture"; done
  same_results localised paper || same_results localised full || fail "$1: the tables on top are a mixture"
  [ -z "$(find localised/methods -name '.exchange')" ] || fail "$1: the journal is still there"
}

before_calibrate() { :; }
after_calibrate() {
  local file
  for file in calibrated/robot.yaml calibrated/robot.calibration.json; do
    cmp -s "$file" "reference/$file" || fail "$1: $file is neither the old nor the new one"
  done
}

before_compare() { parts=$(find compared -type f -path '*parts*' ! -name '*.part' 2>/dev/null | sort | xargs -r cksum); }
after_compare() {
  local now
  now=$(find compared -type f -path '*parts*' ! -name '*.part' 2>/dev/null | sort | xargs -r cksum)
  [ -z "$(comm -23 <(sort <<<"$parts") <(sort <<<"$now"))" ] || fail "$1: a part that was measured is gone, or another"
  [ -e compared/compare.json ] || return
  cmp -s compared/compare.json reference/compare.json || fail "$1: compare.json is not as of the unbroken one"
  echo "compare finished equal" >>finished.txt
  rm -rf compared
}

shards() { find swept/shards -type f ! -path '*/coming-*' 2>/dev/null | sort | xargs -r cksum; }
before_tradeoff() { parts=$(shards); }
after_tradeoff() {
  local now
  now=$(shards)
  [ -z "$(comm -23 <(sort <<<"$parts") <(sort <<<"$now"))" ] || fail "$1: a finished shard is gone, or another"
}

trial() { # NUMBER SIGNAL
  RANDOM=$((1000 + $1)) # its seed
  local command=${commands[$(($1 % ${#commands[@]}))]} what words pid status delay_ms
  "before_$command"
  mapfile -t words < <("${command}_command")
  delay_ms=$((RANDOM * ($(cat "$command.ms") * 11 / 10) / 32768))
  (as_from_a_terminal "$twocone" "${words[@]}") >out 2>errors &
  pid=$!
  sleep "$((delay_ms / 1000)).$(printf %03d $((delay_ms % 1000)))"
  kill -"$2" $pid 2>/dev/null
  wait $pid 2>/dev/null
  status=$?
  what="trial $1, $2 of '${words[*]}' after $delay_ms ms (status $status)"
  if [ "$2" = KILL ]; then
    ((status == 137 || status == 0)) || fail "$what: $(cat errors)"
  else
    ((status == 130 || status == 0)) || fail "$what: $(cat errors)"
    # calibrate writes at its very end and has nothing to say before; others may be hit before they listen.
    if ((status == 130)) && [ -s errors ]; then grep -q 'interrupted: \|interrupted before its first frame' errors || fail "$what: no next step: $(cat errors)"; fi
  fi
  "after_$command" "$what"
  echo "$2 $command $status" >>done.txt
}

count() { grep -c "$1" "$2" 2>/dev/null || true; }
: >shell.err
for signal in KILL INT; do
  first=0
  [ $signal = INT ] && first=100000
  for ((i = $(count "^$signal" done.txt); i < times; i++)); do
    trial $((first + i)) $signal 2>>shell.err
    ((failures)) && cat shell.err >&2 && finish
  done
done

# Whatever they left is read and gone on with to the end.
if [ -e cut/run.yaml ]; then
  remember_tables cut
  "$twocone" run --resume cut >/dev/null 2>errors || fail "the last run is not gone on with: $(cat errors)"
  after_run "the last run"
fi
"$twocone" report localised >/dev/null 2>errors || fail "report: $(cat errors)"
for signal in KILL INT; do
  told=""
  for command in "${commands[@]}"; do told+=", $command $(count "^$signal $command" done.txt)"; done
  echo "$signal: $(count "^$signal" done.txt) in all$told; $(count "^$signal .* \(137\|130\)\$" done.txt) before the command had ended"
done
echo "$(count 'run finished equal' finished.txt) runs finished, each equal to the unbroken one; $(count 'compare finished equal' finished.txt) comparisons likewise; $(count 'journal' finished.txt) exchanges completed by the next opener"
finish
