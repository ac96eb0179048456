#!/bin/sh
# own_vehicle_test.sh SOURCE_DIR BIN_DIR: the commands of the worked example of
# docs/user/own_vehicle.md, on a private bus, from the compiler to a pose: both drivers, in C++ and
# in Python, lead WM to a pose on their circle. The commands are read from the page; only the
# durations are shorter, and what needs a terminal is replaced.
set -u
source=$1
bin=$2
dir=$(mktemp -d)
up=
log=
trap 'kill $up $log 2>/dev/null; wait; rm -rf "$dir"' EXIT
unset STATE_DIRECTORY
export XDG_STATE_HOME="$dir/state"

fail() {
  echo "FAILED: $*"
  tail -n 40 "$dir"/*.txt
  exit 1
}
. "$source/tests/support/needs.sh"
needs "the example of own_vehicle.md" g++ lcm-gen lcm-logger python3

# A folder like that of the reader.
mkdir -p "$dir/build/release"
ln -s "$bin" "$dir/build/release/bin"
ln -s "$(dirname "$bin")/lcmtypes" "$dir/build/release/lcmtypes"
ln -s "$source/docs" "$source/lcmtypes" "$source/config" "$dir/"
cd "$dir" || exit 1

# Waits until a program prints a line, at most 30 s.
until_line() { # FILE PATTERN
  i=0
  until grep -q "$2" "$1" 2>/dev/null; do
    i=$((i + 1))
    [ $i -lt 300 ] || fail "no '$2' in $1"
    sleep 0.1
  done
}
# `rcs up` runs in a terminal of its own.
start_nodes() { # COMMAND
  if [ -n "$up" ]; then kill "$up" && wait "$up"; fi
  $1 >"$dir/up.txt" 2>&1 &
  up=$!
  until_line "$dir/up.txt" '^\[sp\] sp: running'
  until_line "$dir/up.txt" '^\[wm\] wm: running'
}
# The last position in frame world is on the circle of 12 m around (0, 12).
expect_circle() { # CSV FILE
  awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    { v = $(column["world_valid"]); x = $(column["p_world_vehicle_m_0"]); y = $(column["p_world_vehicle_m_1"]) }
    END { error = sqrt(x * x + (y - 12) * (y - 12)) - 12
          printf "world_valid %s, position %.2f %.2f, %.3f m from the circle\n", v, x, y, error
          exit !(NR > 100 && v == 1 && error < 0.2 && error > -0.2 && x * x + y * y > 1) }' "$1"
}

awk '/^## /{on = $0 == "## Worked example"} on && /^```/{block = !block; next} on && block' \
  docs/user/own_vehicle.md | sed 's/  *#.*//' >"$dir/commands"
[ "$(wc -l <"$dir/commands")" -ge 7 ] || fail "no commands in docs/user/own_vehicle.md"
nodes=
drivers=0
while IFS= read -r command; do
  case $command in
    *"rcs up "*)
      nodes=$command
      start_nodes "$nodes"
      ;;
    ./synthetic_vehicle*)
      lcm-logger --lcm-url='udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304' \
        --quiet --force "$dir/run.log" >"$dir/logger.txt" 2>&1 &
      log=$!
      sleep 0.5
      ./synthetic_vehicle 14 >"$dir/cpp.txt" 2>&1 || fail "$command"
      sleep 0.5
      kill $log && wait $log
      log=
      "$bin/rcs" log csv "$dir/run.log" --channel WM_NAV_STATE >"$dir/nav_state.csv" || fail "rcs log csv"
      expect_circle "$dir/nav_state.csv" || fail "the pose of WM with the C++ driver"
      "$bin/rcs" log csv "$dir/run.log" --channel SP_REGISTRATION | tail -n +2 | wc -l >"$dir/scans"
      [ "$(cat "$dir/scans")" -gt 30 ] || fail "$(cat "$dir/scans") registered scans of about 100"
      drivers=$((drivers + 1))
      start_nodes "$nodes"
      ;;
    *"rcs top"*) $command --once >"$dir/top.txt" 2>&1 || fail "$command --once" ;;
    PYTHONPATH=*)
      sh -c "$(echo "$command" | sed 's/ [0-9]*$/ 14/')" >"$dir/python.txt" 2>&1 || fail "$command"
      tail -n 1 "$dir/python.txt"
      # "14.0 s, world, mode 3:    4.62    1.20   0.01 m; truth    4.60    1.19"
      tail -n 1 "$dir/python.txt" | awk '{ gsub(/[:;,]/, " "); dx = $6 - $11; dy = $7 - $12
        exit !($3 == "world" && dx < 0.2 && dx > -0.2 && dy < 0.2 && dy > -0.2) }' ||
        fail "the pose of WM with the Python driver"
      drivers=$((drivers + 1))
      ;;
    *) sh -c "$command" >"$dir/said.txt" 2>&1 || fail "$command" ;;
  esac
done <"$dir/commands"
[ $drivers -eq 2 ] || fail "$drivers drivers ran, not 2"
echo "own_vehicle_test: passed"
