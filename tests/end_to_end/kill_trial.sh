#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Kills (-9) and interrupts programs that write, at random times from a fixed seed. After each trial no table has fewer rows
# than before, and each table equals the beginning of the undisturbed one, or is completely old or completely new. Commands that
# can be resumed are resumed and killed again; in the end their results equal those of an undisturbed command.
#   kill_trial.sh TWOCONE SOURCE_DIR
# TWOCONE_KILLS=N: number of kills, and also of interrupts (default 4). TWOCONE_KILL_WHAT: the commands to kill, in turn (default
# "run localise"; all: "run localise calibrate compare tradeoff"). TWOCONE_KILL_FOLDER: a folder that is kept, in which the next
# call continues.
. "$(dirname "$0")/common.sh"
times=${TWOCONE_KILLS:-4}
read -r -a commands <<<"${TWOCONE_KILL_WHAT:-run localise}"
folder=${TWOCONE_KILL_FOLDER:-$work/trial}
frames=8
[[ " ${commands[*]} " =~ \ (calibrate|compare)\  ]] && frames=24 # calibration needs this many
mkdir -p "$folder"
cd "$folder" || exit 1
touch done.txt finished.txt

# The cameras of this robot draw random numbers and lose frames; tradeoff needs ideal cameras.
small=$source_dir/tests/end_to_end/data/small.yaml
sed "s|\.\./\.\./\.\.|$source_dir|" "$small" >ideal.yaml.new
sed 's|encoder_counts_per_turn: 1024|&, camera: {full_well_electrons: 20000, read_noise_electrons: 3, drop_probability: 0.1, late_probability: 0.1}|' \
  ideal.yaml.new >noisy.yaml.new
for robot in ideal noisy; do cmp -s "$robot.yaml.new" "$robot.yaml" || mv "$robot.yaml.new" "$robot.yaml"; done

now_ms() { echo $(($(date +%s%N) / 1000000)); }
# A program inherits ignored signals, and background jobs of a shell ignore SIGINT.
as_from_a_terminal() { exec env --default-signal=INT,TERM,HUP "$@"; }
tables() { (cd "$1" && find . -name '*.csv' -o -name '*.tum' | grep -v '/\.[a-z]*\.\(new\|old\)/' | sort); }
whole_lines() { grep -c '' <"$1"; }
tables_of_results="ranges.csv fixes.csv sightings.csv estimate.tum track.csv"

run_command() {
  if [ -e cut/run.yaml ]; then set -- run --resume cut; else set -- run --robot noisy.yaml --frames $frames --seed 5 --out cut; fi
  printf '%s\n' "$@"
}
method=outline
localise_command() { printf '%s\n' localise localised --method $method; }
calibrate_command() { printf '%s\n' calibrate whole --frames 12 --out calibrated/robot.yaml --force; }
compare_command() { printf '%s\n' compare whole localised --frames 12 --no-page --out compared; }
tradeoff_command() { printf '%s\n' tradeoff --robot ideal.yaml --episodes 3 --out swept; }

# Runs each command undisturbed and writes its duration to NAME.ms.
timed() { # NAME COMMAND...
  local name=$1 began
  shift
  began=$(now_ms)
  "$twocone" "$@" >"$name.out" 2>"$name.err" || { fail "$name, undisturbed: $(cat "$name.err")"; finish; }
  echo $(($(now_ms) - began)) >"$name.ms"
}
if [ ! -e ready ]; then
  rm -rf whole cut localised reference calibrated compared swept
  mkdir -p reference calibrated
  timed run run --robot noisy.yaml --frames $frames --seed 5 --out whole
  cp -r whole localised
  for method in paper outline; do
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
  echo 15000 >tradeoff.ms # no trial waits for the end of a sweep
  touch ready
fi

# The state before a command, and checks of it afterwards.
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
# Compares whole lines, except for measured times: timing.csv, and the clock in frames.csv.
beginning_of_whole() { # TABLE: succeeds if the table of cut equals the beginning of that of whole
  local n
  n=$(tr -cd '\n' <"cut/$1" | wc -c)
  case $1 in
    */timing.csv) return 0 ;;
    */frames.csv) cmp -s <(head -n "$n" "cut/$1" | cut -d, -f1-9) <(head -n "$n" "whole/$1" | cut -d, -f1-9) ;;
    *) cmp -s <(head -n "$n" "cut/$1") <(head -n "$n" "whole/$1") ;;
  esac
}

before_run() { remember_tables cut; }
after_run() { # WHAT
  check_tables cut "$1"
  [ -e cut ] || return
  local table
  for table in $(tables cut); do beginning_of_whole "$table" || fail "$1: $table differs from that of the undisturbed run"; done
  grep -qs '^finished: true' cut/run.yaml || return
  for table in $(tables whole); do
    [ "$(wc -l <"cut/$table")" = "$(wc -l <"whole/$table")" ] || fail "$1: the run is finished, but $table has fewer lines"
  done
  local image
  for image in whole/*/*.png; do cmp -s "$image" "cut/${image#whole/}" || fail "$1: $image differs"; done
  echo "run finished equal" >>finished.txt
  rm -rf cut
}

before_localise() {
  method=$([ $((RANDOM % 2)) = 0 ] && echo paper || echo outline)
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
  for name in paper outline; do same_results "localised/methods/$name" $name || fail "$1: methods/$name is a mixture"; done
  same_results localised paper || same_results localised outline || fail "$1: the tables of the run folder are a mixture"
  [ -z "$(find localised/methods -name '.exchange')" ] || fail "$1: the journal still exists"
}

before_calibrate() { :; }
after_calibrate() {
  local file
  for file in calibrated/robot.yaml calibrated/robot.calibration.json; do
    cmp -s "$file" "reference/$file" || fail "$1: $file is neither the old nor the new file"
  done
}

before_compare() { parts=$(find compared -type f -path '*parts*' ! -name '*.part' 2>/dev/null | sort | xargs -r cksum); }
after_compare() {
  local now
  now=$(find compared -type f -path '*parts*' ! -name '*.part' 2>/dev/null | sort | xargs -r cksum)
  [ -z "$(comm -23 <(sort <<<"$parts") <(sort <<<"$now"))" ] || fail "$1: a measured part is missing or has changed"
  [ -e compared/compare.json ] || return
  cmp -s compared/compare.json reference/compare.json || fail "$1: compare.json differs from that of the undisturbed command"
  echo "compare finished equal" >>finished.txt
  rm -rf compared
}

shards() { find swept/shards -type f ! -path '*/coming-*' 2>/dev/null | sort | xargs -r cksum; }
before_tradeoff() { parts=$(shards); }
after_tradeoff() {
  local now
  now=$(shards)
  [ -z "$(comm -23 <(sort <<<"$parts") <(sort <<<"$now"))" ] || fail "$1: a finished shard is missing or has changed"
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
    # calibrate writes only at its end and prints nothing before; other commands may be interrupted before they handle signals.
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

# The remaining files are read, and the last run is resumed to its end.
if [ -e cut/run.yaml ]; then
  remember_tables cut
  "$twocone" run --resume cut >/dev/null 2>errors || fail "the last run cannot be resumed: $(cat errors)"
  after_run "the last run"
fi
"$twocone" report localised >/dev/null 2>errors || fail "report: $(cat errors)"
for signal in KILL INT; do
  counts=""
  for command in "${commands[@]}"; do counts+=", $command $(count "^$signal $command" done.txt)"; done
  echo "$signal: $(count "^$signal" done.txt) in all$counts; $(count "^$signal .* \(137\|130\)\$" done.txt) before the command had ended"
done
echo "$(count 'run finished equal' finished.txt) runs finished, each equal to the undisturbed one; $(count 'compare finished equal' finished.txt) comparisons likewise; $(count 'journal' finished.txt) exchanges completed by the next program that opened the folder"
finish
