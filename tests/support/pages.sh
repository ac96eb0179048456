# For the begin of a test of pages, after `source` is set to the folder of the sources: `bin` with the
# programs, and a `folder` that is removed at the end.
#   page_test SUBJECT BIN_DIR   ends as skipped without Chromium or node
#   make_run OPTION...          simulates a drive with these options of `rcs sim` into drive.log, and
#                               replays it into run.log
. "$source/tests/support/needs.sh"

page_test() {
  needs "$1" chromium node
  bin=$2
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
}

make_run() {
  "$bin/rcs" sim "$@" -o "$folder/drive.log" 2>/dev/null
  "$bin/rcs" replay "$source/config/demo3.toml" "$folder/drive.log" -o "$folder/run.log" >/dev/null 2>&1
}
