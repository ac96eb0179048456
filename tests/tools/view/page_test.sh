#!/usr/bin/env bash
# page_test.sh BIN_DIR SOURCE_DIR [PICTURES]: the page of `rcs view` in a headless Chromium, with a log
# of the reference simulation. PICTURES: a folder that keeps the screenshots.
set -euo pipefail
source=$2
. "$source/tests/support/pages.sh"
page_test "the page of rcs view" "$1"
make_run "$source/config/sim/demo.toml" --duration 16
for channel in WM_NAV_STATE SP_POINTS; do
  "$bin/rcs" log csv "$folder/run.log" --channel $channel >"$folder/$channel.csv"
done
exec_status=0
node "$source/tests/tools/view/page_test.mjs" "$bin" "$folder" "${3:-}" || exec_status=$?
exit "$exec_status"
