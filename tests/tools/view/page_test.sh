#!/usr/bin/env bash
# page_test.sh BIN_DIR SOURCE_DIR [PICTURES]: the page of `rcs view` in a headless Chromium, with a log
# of the reference simulation. PICTURES: a folder that keeps the screenshots.
set -euo pipefail
bin=$1 source=$2
. "$source/tests/support/needs.sh"
needs "the page of rcs view" chromium node
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$bin/rcs" sim "$source/config/sim/demo.toml" --duration 16 -o "$folder/drive.log" 2>/dev/null
"$bin/rcs" replay "$source/config/demo3.toml" "$folder/drive.log" -o "$folder/run.log" >/dev/null 2>&1
for channel in WM_NAV_STATE SP_POINTS; do
  "$bin/rcs" log csv "$folder/run.log" --channel $channel >"$folder/$channel.csv"
done
exec_status=0
node "$source/tests/tools/view/page_test.mjs" "$bin" "$folder" "${3:-}" || exec_status=$?
exit "$exec_status"
