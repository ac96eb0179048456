#!/bin/sh
# up_test.sh BIN_DIR CONFIG: `rcs up` with the true nodes, on a private bus: it rejects
# invalid configurations, restarts a node that dies or hangs, stops all nodes, and the nodes end when
# it dies.
set -u
bin=$1
config=$2
running=$2 # configuration that start() uses
dir=$(mktemp -d)
up=
other= # a second recorder
trap 'kill -9 $up $other 2>/dev/null; rm -rf "$dir"' EXIT
unset STATE_DIRECTORY
export XDG_STATE_HOME="$dir/state" # emergency stops are latched there

fail() {
  echo "FAILED: $*"
  cat "$dir"/*.txt
  exit 1
}
# until FILE PATTERN [COUNT]: waits until the file has COUNT lines with the pattern
until_line() {
  i=0
  while [ "$(grep -c "$2" "$1")" -lt "${3:-1}" ]; do
    i=$((i + 1))
    [ $i -lt 300 ] || fail "no '$2' in $1"
    sleep 0.1
  done
}
# the newest pid of a node, from the output of `rcs up`
pid_of() { sed -n "s/^rcs up: $1 started: process //p" "$dir/up.txt" | tail -n 1; }
gone() {
  i=0
  while kill -0 "$1" 2>/dev/null; do
    i=$((i + 1))
    [ $i -lt 100 ] || fail "process $1 is still alive"
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
grep -q note: "$dir/check.txt" && fail "a note about a folder that can be written"
[ -e "$dir/state" ] && fail "--check has created the state directory"
# A user who cannot write there can check the configuration nevertheless.
{ cat "$config"; printf '[process]\nstate_directory = "%s/check.txt/state"\n' "$dir"; } >"$dir/other.toml"
"$bin/rcs" up --check "$dir/other.toml" >"$dir/check2.txt" 2>&1 || fail "--check without write permission"
grep -q "note: cannot write to the folder $dir/check.txt/state: Not a directory.*user that runs the vehicle" \
  "$dir/check2.txt" || fail "no note about a folder that cannot be written"
"$bin/rcs" up "$dir/other.toml" 2>"$dir/start2.txt"
[ $? -eq 3 ] || fail "started without a folder for stops"
{ cat "$config"; printf '[process.wm]\nrealtime_priority = 100\n'; } >"$dir/bad.toml"
"$bin/rcs" up "$dir/bad.toml" 2>"$dir/bad.txt" && fail "a bad configuration was started"
grep -q 'bad.toml:[0-9]*: \[process.wm\] realtime_priority = 100: not in \[0, 98\]' \
  "$dir/bad.txt" || fail "no reason"
{ sed 's/^budget_ms.*/budget_ms = -1/' "$config"; } >"$dir/worse.toml"
"$bin/rcs" up "$dir/worse.toml" 2>"$dir/worse.txt" && fail "a node's bad configuration was started"
grep -q 'budget_ms = -1: not in' "$dir/worse.txt" || fail "no reason of the node"
printf '[up]\nnodes = ["no_such_node"]\n' >"$dir/none.toml"
"$bin/rcs" up "$dir/none.toml" 2>"$dir/none.txt" && fail "a node without a program was started"
grep -q 'no program no_such_node' "$dir/none.txt" || fail "the missing program is not named"
"$bin/rcs" up --nonsense 2>"$dir/usage.txt"
[ $? -eq 2 ] || fail "status of a wrong command line"

start
"$bin/rcs" up "$config" 2>"$dir/second.txt"
[ $? -eq 3 ] || fail "a second one was started"
grep -q 'another `rcs up` runs on' "$dir/second.txt" || fail "no reason against a second one"
"$bin/rcs" up --force "$config" 2>"$dir/second.txt"
[ $? -eq 3 ] || fail "a second one was started by --force"

kill -9 "$(pid_of sp)"
until_line "$dir/up.txt" 'sp was killed by signal 9.*; restart in 0.2 s'
until_line "$dir/up.txt" '^\[sp\] sp: running' 2
# A node that is restarted reads the configuration of the run, whatever happens to the file.
cp "$config" "$dir/edited.toml"
kill -TERM $up
wait $up
running=$dir/edited.toml
start
echo 'nonsense = [' >>"$dir/edited.toml"
kill -9 "$(pid_of sp)"
until_line "$dir/up.txt" '^\[sp\] sp: running on .*edited.toml' 2
# A node of another configuration is of another run.
running=$2
kill -TERM $up
wait $up
start
kill -STOP "$(pid_of wm)"
until_line "$dir/up.txt" 'wm hangs: nothing on WM_PROCESS for 5 s; killed'
until_line "$dir/up.txt" '^\[wm\] wm: running' 2

# A wm without sensor data publishes a result nevertheless.
"$bin/rcs" predict --to 100,0 2>"$dir/path_uncertainty.txt"
[ $? -eq 3 ] || fail "status of rcs predict"
grep -q 'WM has no world pose yet' "$dir/path_uncertainty.txt" || fail "no result of wm for a path"
"$bin/rcs" predict --to 100 2>"$dir/usage.txt"
[ $? -eq 2 ] || fail "status of an invalid path"

sp=$(pid_of sp)
wm=$(pid_of wm)
kill -TERM $up
wait $up || fail "status after SIGTERM"
grep -q '^rcs up: all stopped' "$dir/up.txt" || fail "no message at the end"
gone "$sp"
gone "$wm"

# An emergency stop survives a restart of all processes, independently of commands.
start --force
grep -q 'an emergency stop is latched' "$dir/up.txt" && fail "a stop is reported before one was latched"
until_line "$dir/up.txt" '^\[bg\] bg: running'
timeout 20 "$bin/rcs" go --emergency-stop 2>"$dir/stop.txt" || fail "status of rcs go --emergency-stop"
kill -9 $up
start --force
until_line "$dir/up.txt" "an emergency stop is latched (operator; $dir/state/rcs/.*stop)"
until_line "$dir/up.txt" '^\[bg\] bg: running'
"$bin/rcs" go --waypoint 9,0 --patience 1 2>"$dir/go.txt"
[ $? -eq 1 ] || fail "status of rcs go while a stop is latched"
grep -q 'emergency stop is latched; release it at rest first' "$dir/go.txt" || fail "no reason for the rejected command"
"$bin/rcs" top --once >"$dir/top.txt" 2>&1 || fail "rcs top --once"
grep -q EMERGENCY_STOP "$dir/top.txt" || fail "rcs top does not show the latched stop"
# Without sensors it is not known that the vehicle is at rest.
"$bin/rcs" go --release 2>"$dir/release.txt"
[ $? -eq 1 ] || fail "status of a release without a known speed"
grep -q 'the world model is silent' "$dir/release.txt" || fail "no reason for the rejected release"
kill -9 $up
rm -r "$dir/state"

# A vehicle that cannot latch stops does not start.
{ cat "$config"; printf '[process]\nstate_directory = "/proc/nowhere"\n'; } >"$dir/nowhere.toml"
"$bin/rcs" up --force "$dir/nowhere.toml" 2>"$dir/nowhere.txt" && fail "started without a folder for stops"
grep -q 'set \[process\] state_directory' "$dir/nowhere.txt" || fail "the missing key is not named"


# A node that cannot start does not stop the others. The gateway has neither keys nor `unsecured`.
sed -e 's/^unsecured = true/unsecured = false/' -e 's/^nodes = .*/nodes = ["sp", "wm", "bg", "gateway"]/' \
  "$config" >"$dir/lame.toml"
"$bin/rcs" up --check "$dir/lame.toml" 2>"$dir/lame.txt"
[ $? -eq 1 ] || fail "--check of a gateway without keys"
grep -q 'gateway .*--check ended with status 1' "$dir/lame.txt" || fail "the node that --check rejects is not named"
running=$dir/lame.toml
start --force
grep -q 'gateway is not critical: the other nodes start without it' "$dir/up.txt" || fail "the other nodes were not started"
until_line "$dir/up.txt" 'ALARM: gateway fails repeatedly'
until_line "$dir/up.txt" 'gateway ended with status 3; restart in 10.0 s'
# Nor does a critical node that was alive and ends again and again.
sp=$(pid_of sp)
for k in 1 2 3; do
  kill -9 "$(pid_of wm)"
  until_line "$dir/up.txt" '^rcs up: wm started: process' $((k + 1))
done
until_line "$dir/up.txt" 'ALARM: wm fails repeatedly'
"$bin/rcs" top --once >"$dir/top.txt" || fail "rcs top"
grep -q '^up: wm fails repeatedly.*; gateway fails repeatedly' "$dir/top.txt" || fail "no note in rcs top"
until_line "$dir/up.txt" '^\[wm\] wm: running' 2
[ "$(pid_of sp)" = "$sp" ] && kill -0 "$sp" || fail "sp was restarted or has ended"
kill -TERM $up
wait $up || fail "status after SIGTERM"

# The recorder is not critical: it dies, and the nodes keep running.
"$bin/rcs" record "$dir/other" --reserve-mb 0 2>"$dir/other.txt" &
other=$!
running=$config
start --force --record "$dir/recording"
until_line "$dir/up.txt" '^\[record\] rcs record: recording all channels'
sp=$(pid_of sp)
kill -9 "$(pid_of record)"
until_line "$dir/up.txt" 'record was killed by signal 9.*; restart in 0.2 s'
until_line "$dir/up.txt" 'ALARM: messages are not recorded until the recorder runs again'
until_line "$dir/up.txt" '^\[record\] rcs record: recording all channels' 2
[ "$(pid_of sp)" = "$sp" ] && kill -0 "$sp" || fail "sp was restarted or has ended"
sleep 2
kill -TERM $up
wait $up || fail "status after SIGTERM"
kill -INT $other
wait $other || fail "status of rcs record after SIGINT"
"$bin/rcs" log info "$dir/recording" >"$dir/info.txt" || fail "rcs log info of a recording"
grep -q '^WM_PROCESS ' "$dir/info.txt" || fail "no messages of wm in the recording"
grep -q recorder_ended "$dir"/recording/audit-*.jsonl || fail "the recorder was not ended cleanly"
"$bin/rcs" log cut "$dir/other" --around recorder.ended --before 1 --after 1 -o "$dir/part.log" 2>"$dir/part.txt" ||
  fail "no event for the end of the recorder"
# A recorder that cannot start does not stop the nodes.
start --force --record /proc/nowhere
until_line "$dir/up.txt" '/proc/nowhere: cannot record to this folder'
until_line "$dir/up.txt" 'ALARM: record fails repeatedly.*; the other nodes keep running'
kill -0 "$(pid_of sp)" || fail "sp has ended"
kill -TERM $up
wait $up || fail "status after SIGTERM"
# Without a folder: in the state directory.
start --force --record
until_line "$dir/up.txt" "recording all channels of .* to $dir/state/rcs/recordings"
kill -TERM $up
wait $up || fail "status after SIGTERM"

start --force
sp=$(pid_of sp)
wm=$(pid_of wm)
kill -9 $up
gone "$sp"
gone "$wm"
echo "up_test: passed"
