#!/usr/bin/env bash
# mcap_core_test.sh BIN_DIR SOURCE_DIR: a run with all nodes as MCAP, read by the packages of Foxglove:
# every number of `rcs log csv`. For development: needs node 20 and a folder with the packages,
#   npm install --prefix DIR @mcap/core@2.2.2 @foxglove/rosmsg@5.0.5 \
#       @foxglove/rosmsg2-serialization@3.1.0 fzstd@0.1.1
#   RCS_NODE_MODULES=DIR/node_modules
set -euo pipefail
bin=$1 source=$2
if [[ ! -d ${RCS_NODE_MODULES:-}/@mcap/core ]] || ! node -e 'process.exit(parseInt(process.versions.node) < 20)'; then
  echo "SKIPPED, NOT TESTED: MCAP files with @mcap/core: set RCS_NODE_MODULES (see the script)" >&2
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$bin/rcs" sim "$source/config/sim/drill.toml" --duration "${3:-15}" -o "$folder/drive.log" 2>/dev/null
"$bin/rcs" replay "$source/config/demo3.toml" "$folder/drive.log" -o "$folder/run.log" >/dev/null 2>&1
for compression in zstd none; do
  "$bin/rcs" log mcap "$folder/run.log" -o "$folder/run.mcap" --config "$source/config/demo3.toml" \
    --compression $compression
  while read -r channel; do
    "$bin/rcs" log csv "$folder/run.log" --channel "$channel" >"$folder/$channel.csv"
  done < <("$bin/rcs" log info "$folder/run.log" --json | grep -o '"channel": "[A-Z_]*"' | cut -d'"' -f4)
  node "$source/tests/tools/mcap/mcap_core_check.mjs" "$folder/run.mcap" "$folder"
done
