#!/bin/sh
# install_test.sh CMAKE BUILD_DIR BIN_DIR DATA_DIR UNIT_DIR: the files that `cmake --install` creates
# work in place: the programs find each other, the configurations are read, the units are complete.
set -u
cmake=$1
build=$2
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
fail() {
  echo "FAILED: $*"
  cat "$dir/said.txt" 2>/dev/null
  exit 1
}
# A program that was not built is not installed; this test detects that.
DESTDIR="$dir/root" "$cmake" --install "$build" >"$dir/said.txt" 2>&1 || fail "cmake --install"
bin=$dir/root$3
data=$dir/root$4
units=$dir/root$5/systemd/system

"$bin/rcs" --help >"$dir/said.txt" 2>&1 || fail "rcs --help"
"$bin/rcs" up --help >"$dir/said.txt" 2>&1 || fail "rcs up --help"
grep -q Examples "$dir/said.txt" || fail "rcs up --help has no example"
for vehicle in "$data"/rcs/config/*.toml; do
  # From another folder, and without the programs of the build.
  (cd / && PATH=/usr/bin:/bin "$bin/rcs" up --check "$vehicle") >"$dir/said.txt" 2>&1 ||
    fail "--check $vehicle"
done
# The installed configurations are found from any folder, by default and by their names.
here() { (cd / && PATH=/usr/bin:/bin "$bin/rcs" "$@") >"$dir/said.txt" 2>&1; }
here drill --list || fail "rcs drill --list"
here config check config/demo3.toml || fail "rcs config check"
here up --check config/demo3.toml || fail "rcs up --check"
for scenario in drill drill_corridor; do # the second reads an elevation raster
  here sim "config/sim/$scenario.toml" --duration 1 -o "$dir/a.log" || fail "rcs sim $scenario"
done
here drill config/drills/gps/d01_dropout_60s.toml --list || fail "a drill by its name"
here table1 --pairs 1 --seeds 1 || fail "rcs table1"
here sim config/sim/no_such.toml && fail "a missing scenario was accepted"
[ -s "$data/rcs/config/sim/demo.toml" ] || fail "no scenarios"
[ -s "$data/rcs/rcs-bus.nft" ] || fail "no firewall rules"
[ -s "$dir/root$5/sysctl.d/60-rcs.conf" ] || fail "no sysctl file"
for unit in rcs.service rcs-bus.service; do
  [ -s "$units/$unit" ] || fail "no $unit"
  grep -n '@[A-Z_]*@' "$units/$unit" >"$dir/said.txt" && fail "$unit is not filled in"
done
grep -q '^StateDirectory=rcs$' "$units/rcs.service" || fail "no folder for emergency stops"
grep -q "^ExecStart=$3/rcs up " "$units/rcs.service" || fail "rcs.service runs another rcs"
for page in rcs rcs-replay rcs-map sp sim; do
  [ -s "$data/man/man1/$page.1" ] || fail "no man page $page"
done
bash -c ". '$data/bash-completion/completions/rcs' && complete -p rcs" >"$dir/said.txt" 2>&1 ||
  fail "no completion"
echo "install_test: passed"
