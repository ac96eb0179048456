#!/bin/bash
# live_pages_test.sh SOURCE_DIR BIN_DIR: the commands of docs/user that need a bus, a running vehicle
# or a terminal, on a private bus: a drive with `rcs go`, record, play, emergency stop and release,
# `rcs predict`, `rcs top`, and an operator over DDS with keys. Each command is read from its page.
set -u
source=$1
bin=$2
dir=$(mktemp -d)
pids=()
stop() { # all that was started, the newest first
  local k
  for ((k = ${#pids[@]} - 1; k >= 0; --k)); do
    kill "${pids[k]}" 2>/dev/null
    wait "${pids[k]}" 2>/dev/null
  done
  pids=()
}
trap 'stop; rm -rf "$dir"' EXIT
unset STATE_DIRECTORY RCS_KEYS CYCLONEDDS_URI
export XDG_STATE_HOME="$dir/state"

fail() {
  echo "FAILED: $*"
  tail -n 25 "$dir"/*.txt
  exit 1
}
. "$source/tests/support/needs.sh"
needs "the commands of the pages" lcm-logger lcm-logplayer openssl
[ -x "$bin/dds_client" ] || { echo "SKIPPED, NOT TESTED: dds_client is not built"; exit 77; }

mkdir -p "$dir/build/release"
ln -s "$bin" "$dir/build/release/bin"
ln -s "$source/docs" "$source/lcmtypes" "$dir/"
cp -r "$source/config" "$dir/config"
cd "$dir" || exit 1

# The line of a page that begins with these words, without its comment and final &.
command_of() { # PAGE BEGINNING
  local line
  line=$(awk -v begin="$2" '/^```/{block = !block; next} block && index($0, begin) == 1 {print; exit}' "docs/user/$1.md" |
    sed -E 's/ +#.*//; s/ &$//')
  [ -n "$line" ] || fail "docs/user/$1.md has no command $2" >&2
  echo "$line"
}
start() { # NAME COMMAND
  echo "  $2 &"
  bash -c "exec $2" >"$dir/$1.txt" 2>&1 &
  pids+=($!)
}
expect() { # STATUS COMMAND
  echo "  $2"
  timeout 400 bash -c "rcs=build/release/bin/rcs; $2" >"$dir/said.txt" 2>&1 </dev/null
  local status=$?
  [ $status -eq "$1" ] || fail "status $status instead of $1: $2"
}
until_line() { # FILE PATTERN SECONDS
  local i=0
  until grep -qE "$2" "$1" 2>/dev/null; do
    ((++i < 10 * $3)) || fail "no '$2' in $1"
    sleep 0.1
  done
}
nodes_run() { for node in "$@"; do until_line "$dir/up.txt" "^\[$node\] $node: running" 60; done; }

echo "commanding.md, maps.md: a drive"
start logger "$(command_of replay lcm-logger)"
start sim "$(command_of commanding build/release/bin/sim)"
start up "$(command_of commanding 'build/release/bin/rcs up')"
nodes_run sp wm bg
expect 0 "$(command_of commanding 'build/release/bin/rcs go --scenario')"
expect 0 "$(command_of commanding 'build/release/bin/rcs go --halt')"
expect 0 "$(command_of maps '$rcs predict')"
expect 0 "$(command_of vehicle_install 'build/release/bin/rcs top --once')"
expect 0 "$(command_of vehicle_install 'build/release/bin/rcs top --json')"
expect 0 "$(command_of commanding 'build/release/bin/rcs go --emergency-stop')"
expect 0 "$(command_of vehicle_install 'build/release/bin/rcs top --once')"
grep -q EMERGENCY_STOP "$dir/said.txt" || fail "rcs top does not show the emergency stop"
expect 0 "$(command_of commanding 'build/release/bin/rcs go --release')"
# Waypoints near the start, for some seconds: the options are valid, BG accepts the command.
going=$(command_of commanding 'build/release/bin/rcs go --waypoint 10,0')
timeout -s INT 8 bash -c "exec $going" >"$dir/go.txt" 2>&1
grep -qE '"state"|"reached"|waypoint|rcs go' "$dir/go.txt" || fail "$going"
stop

echo "replay.md: play"
expect 0 "$(command_of replay 'build/release/bin/rcs log info')"
start up "$(command_of commanding 'build/release/bin/rcs up')"
nodes_run sp wm bg
expect 0 "$(command_of replay 'build/release/bin/rcs play') --duration 8"
grep -q 'mode: ALIGN -> ' "$dir/up.txt" || fail "WM had no mode with rcs play"
stop
start up "$(command_of commanding 'build/release/bin/rcs up')"
nodes_run sp wm bg
expect 0 "$(command_of replay 'build/release/bin/rcs log cut my_run.log --sensors')"
start player "$(command_of replay lcm-logplayer)"
until_line "$dir/up.txt" 'mode: ALIGN -> ' 30
stop

echo "dds.md: an operator"
expect 0 "$(command_of dds 'build/release/bin/rcs keys')"
# The configuration of the page: its first TOML block, with the vehicle of the demo.
awk '/^```toml/{n++; block = n == 1; next} /^```/{block = 0} block' docs/user/dds.md >"$dir/page.toml"
{
  awk '/^\[(gateway|up|vehicle)/{skip = 1} /^\[/ && !/^\[(gateway|up|vehicle)/{skip = 0} !skip' config/demo3.toml
  cat "$dir/page.toml"
} >config/with_keys.toml
grep -q 'directory = "../keys/demo3"' config/with_keys.toml || fail "no [gateway.security] in docs/user/dds.md"
start sim "$(command_of commanding build/release/bin/sim)"
start up "build/release/bin/rcs up config/with_keys.toml"
nodes_run sp wm bg gateway
exports="$(command_of dds 'export RCS_KEYS'); $(command_of dds 'export CYCLONEDDS_URI')"
dds() { # STATUS BEGINNING [REPLACEMENT]
  local line
  line=$(command_of dds "build/release/bin/dds_client $2")
  expect "$1" "$exports; ${line/watch 10/watch 5}"
}
until_line "$dir/up.txt" 'mode: ALIGN -> ' 60
dds 0 "-v demo3 watch"
grep -q VehicleState "$dir/said.txt" || grep -qi state "$dir/said.txt" || fail "dds_client watch shows no state"
dds 0 "-v demo3 -o alice halt"
dds 0 "-v demo3 -o alice stop"
expect 0 "$(command_of vehicle_install 'build/release/bin/rcs top --once')"
grep -q EMERGENCY_STOP "$dir/said.txt" || fail "the stop over DDS is not in force"
dds 0 "-v demo3 -o alice release"
dds 0 "-v demo3 -o alice goto"
stop
echo "live_pages_test: passed"
