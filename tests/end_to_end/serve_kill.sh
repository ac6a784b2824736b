#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Kills (kill -9) programs of one served world at random times. The others must notice or continue within two seconds, and
# no file or process may remain.
#   serve_kill.sh TWOCONE SOURCE_DIR [TIMES SEED]
. "$(dirname "$0")/common.sh"
times=${3:-3}
RANDOM=${4:-1}
export XDG_RUNTIME_DIR=$work/runtime
mkdir -m 700 "$XDG_RUNTIME_DIR"
name=hall
folder=$XDG_RUNTIME_DIR/twocone
noticed_ms=2000 # time limit within which the other programs must notice
waits_ms=5000   # additional time for a robot that has not attached yet: it waits this long for a world that may be starting
patience_s=60   # time limit of operations that render

now_ms() { echo $(($(date +%s%N) / 1000000)); }

# A zombie counts as dead: it has only not been reaped yet.
alive() { grep -qs '^State:.[^ZX]' "/proc/$1/status"; }

# eventually SECONDS COMMAND...: repeats the command until it succeeds or the time is over.
eventually() {
  local deadline=$(($(now_ms) + $1 * 1000))
  shift
  until "$@"; do
    (($(now_ms) < deadline)) || return 1
    sleep 0.02
  done
}

dead() { ! alive "$1"; }
nothing_left() { [ -z "$(ls -A "$folder" 2>/dev/null)" ]; }
rows() { cat "$1/frames.csv" 2>/dev/null | wc -l; }
has_rows() { (($(rows "$1") >= $2)); }
said() { grep -qs -- "$1" "$work/server"; }

start_server() {
  "$twocone" serve --scene "$source_dir/scenes/pair/pair.map.yaml" --name "$name" 2>"$work/server" >/dev/null &
  server=$!
  eventually "$patience_s" said "serving '$name'" || fail "the server does not start: $(cat "$work/server")"
}
start_robot() { # FILE OUT
  "$twocone" run --robot "$source_dir/robots/pair/$1.yaml" --frames 100000 --behaviour still --out "$work/$2" \
    >/dev/null 2>"$work/$2.errors" &
}
# end PID NAME STATUS: sends SIGTERM, waits, and checks the status. A run that SIGTERM ends has status 128 + 15.
end() {
  kill -TERM "$1" 2>/dev/null
  eventually "$patience_s" dead "$1" || { fail "$2 does not end"; kill -9 "$1"; }
  wait "$1"
  local status=$?
  ((status == $3)) || fail "$2 ended with $status instead of $3"
}

shm_before=$(ls -A /dev/shm 2>/dev/null)
longest_ms=0
note() { ((${1} > longest_ms)) && longest_ms=$1; }

for ((i = 0; i < times; i++)); do
  victim=$((RANDOM % 3))
  delay=$(printf '0.%03d' $((RANDOM % 1000)))
  start_server
  start_robot one "one$i"
  one=$!
  start_robot two "two$i"
  two=$!
  # In half of the trials both robots certainly run. In the others the kill may happen at any time, also before they attach.
  if ((RANDOM % 2)); then
    for out in "one$i" "two$i"; do
      eventually "$patience_s" has_rows "$work/$out" 2 || fail "$out does not run: $(cat "$work/$out.errors")"
    done
  fi
  sleep "$delay"
  children=$(pgrep -P "$server" -d ' ' || true)

  limit_ms=$noticed_ms
  if ((victim == 0)); then
    began=$(now_ms)
    kill -9 "$server"
    for pid in "$one" "$two" $children; do
      eventually 10 dead "$pid" || fail "time $i: process $pid continues without the server"
    done
    took=$(($(now_ms) - began))
    wait "$server" 2>/dev/null
    for pid in "$one" "$two"; do
      wait "$pid" && fail "time $i: a run ended with status 0 although its world is gone"
    done
    for out in "one$i" "two$i"; do
      (($(wc -l <"$work/$out.errors") >= 1)) || fail "time $i: $out ended without a message"
    done
    { said "robot.1 attached" && said "robot.2 attached"; } || limit_ms=$((noticed_ms + waits_ms))
    # If no robot was attached when the server was killed, its files stay until the next server starts.
    said attached && { nothing_left || eventually 1 nothing_left || fail "time $i: left in $folder: $(ls -A "$folder")"; }
    echo "time $i: server killed, noticed within $took ms"
  else
    if ((victim == 1)); then killed=$one number=1 file=one other=$two out=two$i; else killed=$two number=2 file=two other=$one out=one$i; fi
    was_there=no
    said "robot.$number attached" && was_there=yes
    began=$(now_ms)
    kill -9 "$killed"
    wait "$killed" 2>/dev/null
    if [ "$was_there" = yes ]; then
      eventually 10 said "robot.$number left: the program ended" || fail "time $i: the server has not noticed: $(cat "$work/server")"
    fi
    took=$(($(now_ms) - began))
    alive "$server" || fail "time $i: the server ended with robot $number: $(cat "$work/server")"
    before=$(rows "$work/$out")
    eventually "$patience_s" has_rows "$work/$out" $((before + 2)) || fail "time $i: the other robot does not continue: $(cat "$work/$out.errors")"
    timeout "$patience_s" "$twocone" run --robot "$source_dir/robots/pair/$file.yaml" --frames 2 --behaviour still \
      --out "$work/again$i" >/dev/null 2>"$work/again.errors" || fail "time $i: robot $number cannot join again: $(cat "$work/again.errors")"
    end "$other" "time $i: the other robot" 143
    end "$server" "time $i: the server" 0
    nothing_left || fail "time $i: left in $folder: $(ls -A "$folder")"
    echo "time $i: robot $number killed, noticed within $took ms"
  fi
  note "$took"
  ((took <= limit_ms)) || fail "time $i: noticed only after $took ms"
  for pid in "$server" "$one" "$two" $children; do
    eventually 5 dead "$pid" || { fail "time $i: process $pid still runs"; kill -9 "$pid"; }
  done
  rm -rf "$work/one$i" "$work/two$i" "$work/again$i"
done
shm_as_before() { [ "$(ls -A /dev/shm 2>/dev/null)" = "$shm_before" ]; }
eventually 2 shm_as_before || fail "left in /dev/shm: $(ls -A /dev/shm)"
echo "$times killed, noticed within $longest_ms ms at most"
finish
