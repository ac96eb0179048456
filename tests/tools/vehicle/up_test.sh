#!/bin/sh
# up_test.sh BIN_DIR CONFIG: `rcs up` with the true nodes, on a private bus: it refuses what is wrong,
# starts a node again that dies or hangs, stops all, and takes the nodes with it when it dies.
set -u
bin=$1
config=$2
running=$2 # what start() starts
dir=$(mktemp -d)
up=
trap 'kill -9 $up 2>/dev/null; rm -rf "$dir"' EXIT
unset STATE_DIRECTORY
export XDG_STATE_HOME="$dir/state" # emergency stops are latched there

fail() {
  echo "FAILED: $*"
  cat "$dir"/*.txt
  exit 1
}
# until FILE PATTERN [COUNT]: the file gets so many lines with the pattern
until_line() {
  i=0
  while [ "$(grep -c "$2" "$1")" -lt "${3:-1}" ]; do
    i=$((i + 1))
    [ $i -lt 300 ] || fail "no '$2' in $1"
    sleep 0.1
  done
}
# the newest process of a node, as `rcs up` tells
pid_of() { sed -n "s/^rcs up: $1 started: process //p" "$dir/up.txt" | tail -n 1; }
gone() {
  i=0
  while kill -0 "$1" 2>/dev/null; do
    i=$((i + 1))
    [ $i -lt 100 ] || fail "process $1 lives on"
    sleep 0.1
  done
}
start() {
  "$bin/rcs" up "$running" "$@" 2>"$dir/up.txt" &
  up=$!
  until_line "$dir/up.txt" '^\[sp\] sp: running'
  until_line "$dir/up.txt" '^\[wm\] wm: running'
}

"$bin/rcs" up --check "$config" >"$dir/check.txt" 2>&1 || fail "--check of $config"
{ cat "$config"; printf '[process.wm]\nrealtime_priority = 100\n'; } >"$dir/bad.toml"
"$bin/rcs" up "$dir/bad.toml" 2>"$dir/bad.txt" && fail "a bad configuration was started"
grep -q 'bad.toml:[0-9]*: \[process.wm\] realtime_priority = 100: not in \[0, 98\]' \
  "$dir/bad.txt" || fail "the reason"
{ sed 's/^budget_ms.*/budget_ms = -1/' "$config"; } >"$dir/worse.toml"
"$bin/rcs" up "$dir/worse.toml" 2>"$dir/worse.txt" && fail "a node's bad configuration was started"
grep -q 'budget_ms = -1: not in' "$dir/worse.txt" || fail "the node's reason"
printf '[up]\nnodes = ["no_such_node"]\n' >"$dir/none.toml"
"$bin/rcs" up "$dir/none.toml" 2>"$dir/none.txt" && fail "a node without a program was started"
grep -q 'no program no_such_node' "$dir/none.txt" || fail "which program"
"$bin/rcs" up --nonsense 2>"$dir/usage.txt"
[ $? -eq 2 ] || fail "status of a wrong command line"

start
"$bin/rcs" up "$config" 2>"$dir/second.txt"
[ $? -eq 1 ] || fail "a second one was started"
grep -q 'is alive on .* already' "$dir/second.txt" || fail "why not a second one"

kill -9 "$(pid_of sp)"
until_line "$dir/up.txt" 'sp was killed by signal 9.*; again in 0.2 s'
until_line "$dir/up.txt" '^\[sp\] sp: running' 2
kill -STOP "$(pid_of wm)"
until_line "$dir/up.txt" 'wm hangs: nothing on WM_PROCESS for 5 s; killed'
until_line "$dir/up.txt" '^\[wm\] wm: running' 2

# A wm that has heard no sensor answers all the same.
"$bin/rcs" predict --to 100,0 2>"$dir/path_uncertainty.txt"
[ $? -eq 1 ] || fail "status of rcs predict"
grep -q 'WM does not know where it is yet' "$dir/path_uncertainty.txt" || fail "wm's answer about a path"
"$bin/rcs" predict --to 100 2>"$dir/usage.txt"
[ $? -eq 2 ] || fail "status of a path that is none"

sp=$(pid_of sp)
wm=$(pid_of wm)
kill -TERM $up
wait $up || fail "status after SIGTERM"
grep -q '^rcs up: all stopped' "$dir/up.txt" || fail "the end"
gone "$sp"
gone "$wm"

# An emergency stop outlives all processes, whatever is commanded.
start --force
grep -q 'an emergency stop is latched' "$dir/up.txt" && fail "a stop before there was one"
until_line "$dir/up.txt" '^\[bg\] bg: running'
timeout 20 "$bin/rcs" go --emergency-stop 2>"$dir/stop.txt" || fail "status of rcs go --emergency-stop"
kill -9 $up
start --force
until_line "$dir/up.txt" "an emergency stop is latched (operator, serial [0-9]*; $dir/state/rcs/.*stop)"
until_line "$dir/up.txt" '^\[bg\] bg: running'
"$bin/rcs" go --waypoint 9,0 --patience 1 2>"$dir/go.txt"
[ $? -eq 1 ] || fail "status of rcs go while a stop is latched"
grep -q 'emergency stop is latched: release it at rest first' "$dir/go.txt" || fail "why not"
"$bin/rcs" top --once >"$dir/top.txt" 2>&1 || fail "rcs top --once"
grep -q EMERGENCY_STOP "$dir/top.txt" || fail "rcs top does not show the latched stop"
# No sensor, so that rest is not known.
"$bin/rcs" go --release 2>"$dir/release.txt"
[ $? -eq 1 ] || fail "status of a release without a known speed"
grep -q 'the world model is silent' "$dir/release.txt" || fail "why it is not released"
kill -9 $up
rm -r "$dir/state"

# A vehicle whose stops could not be latched does not start.
{ cat "$config"; printf '[process]\nstate_directory = "/proc/nowhere"\n'; } >"$dir/nowhere.toml"
"$bin/rcs" up --check "$dir/nowhere.toml" 2>"$dir/nowhere.txt" && fail "no folder for stops"
grep -q 'set \[process\] state_directory' "$dir/nowhere.txt" || fail "which key to set"


# A node that cannot start takes no other with it. The gateway has neither keys nor `plain`.
sed -e 's/^plain = true/plain = false/' -e 's/^nodes = .*/nodes = ["sp", "wm", "bg", "gateway"]/' \
  "$config" >"$dir/lame.toml"
"$bin/rcs" up --check "$dir/lame.toml" 2>"$dir/lame.txt"
[ $? -eq 1 ] || fail "--check of a gateway without keys"
grep -q 'gateway .*--check ended with status 1' "$dir/lame.txt" || fail "which node --check refuses"
running=$dir/lame.toml
start --force
grep -q 'gateway is not critical: the other nodes start without it' "$dir/up.txt" || fail "the start"
until_line "$dir/up.txt" 'ALARM: gateway does not stay up'
until_line "$dir/up.txt" 'gateway ended with status 1; again in 10.0 s'
# Nor does a critical one that was alive, and it is back when its configuration is.
sp=$(pid_of sp)
cp "$dir/lame.toml" "$dir/good.toml"
printf '\n[wm.modes]\nreset_m = -1\n' >>"$dir/lame.toml"
kill -9 "$(pid_of wm)"
until_line "$dir/up.txt" 'ALARM: wm does not stay up'
"$bin/rcs" top --once >"$dir/top.txt" || fail "rcs top"
grep -q '^up: wm does not stay up.*; gateway does not stay up' "$dir/top.txt" || fail "top's note"
cp "$dir/good.toml" "$dir/lame.toml"
until_line "$dir/up.txt" '^\[wm\] wm: running' 2
[ "$(pid_of sp)" = "$sp" ] && kill -0 "$sp" || fail "sp was restarted or is gone"
kill -TERM $up
wait $up || fail "status after SIGTERM"

running=$config
start --force
sp=$(pid_of sp)
wm=$(pid_of wm)
kill -9 $up
gone "$sp"
gone "$wm"
echo "up_test: passed"
