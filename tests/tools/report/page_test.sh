#!/usr/bin/env bash
# page_test.sh BIN_DIR SOURCE_DIR [PICTURES]: the plots of a page of `rcs report` in a headless Chromium.
# PICTURES: a folder that keeps the screenshots.
set -euo pipefail
source=$2
. "$source/tests/support/pages.sh"
page_test "the plots of rcs report" "$1"
make_run "$source/config/sim/drill.toml" --duration 20 --gps-outage 8,6
"$bin/rcs" report "$folder/run.log" -o "$folder/page.html" >/dev/null
"$bin/rcs" log csv "$folder/run.log" --channel WM_NAV_STATE >"$folder/nav.csv"
"$bin/rcs" log csv "$folder/run.log" --channel SIM_TRUTH >"$folder/truth.csv"
exec_status=0
node "$source/tests/tools/report/page_test.mjs" "$folder" "${3:-}" || exec_status=$?
exit "$exec_status"
