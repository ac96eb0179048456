#!/usr/bin/env bash
# shot_test.sh BIN_DIR SOURCE_DIR [PICTURES]: `rcs view LOG --shot` for each panel. PICTURES: a
# folder that keeps the pictures.
set -euo pipefail
source=$2
. "$source/tests/support/pages.sh"
page_test "the pictures of rcs view" "$1"
make_run "$source/config/sim/demo.toml" --duration 16
pictures=${3:-$folder}
for panel in all 3d timeline status pairs; do
  "$bin/rcs" view "$folder/run.log" --shot t=12.5 --panel $panel --size 900x600 -o "$pictures/$panel.png" 2>/dev/null
done
"$bin/rcs" view "$folder/run.log" --shot t=12.5 --panel all --size 900x600 --dark -o "$pictures/dark.png" 2>/dev/null
"$bin/rcs" view "$folder/run.log" --shot t=6 --panel 3d --size 900x600 -o "$pictures/earlier.png" 2>/dev/null
node "$source/tests/tools/view/shot_test.mjs" "$pictures"

# Moments and panels that do not exist; nothing is written.
status=0
"$bin/rcs" view "$folder/run.log" --shot t=99999 -o "$folder/none.png" 2>"$folder/error" || status=$?
[[ $status == 3 ]] && grep -q "ends after" "$folder/error" && [[ ! -e $folder/none.png ]]
status=0
"$bin/rcs" view "$folder/run.log" --shot t=1 --panel map -o "$folder/none.png" 2>"$folder/error" || status=$?
[[ $status == 2 ]] && grep -q "expected all, 3d" "$folder/error" && [[ ! -e $folder/none.png ]]
# A folder that cannot be written to.
status=0
"$bin/rcs" view "$folder/run.log" --shot t=1 -o "$folder/missing/none.png" 2>"$folder/error" || status=$?
[[ $status == 3 ]] && grep -q "missing/none.png" "$folder/error"
echo "shot_test: passed"
