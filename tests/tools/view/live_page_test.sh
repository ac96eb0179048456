#!/usr/bin/env bash
# live_page_test.sh BIN_DIR SOURCE_DIR [PICTURES]: the page of `rcs view` beside `rcs up` and the
# simulator, on a private bus. PICTURES: a folder that keeps the screenshots.
set -euo pipefail
source=$2
. "$source/tests/support/pages.sh"
page_test "the live page of rcs view" "$1"
unset STATE_DIRECTORY
export XDG_STATE_HOME="$folder/state"
exec_status=0
node "$source/tests/tools/view/live_page_test.mjs" "$bin" "$source/config" "$folder" "${3:-}" || exec_status=$?
exit "$exec_status"
