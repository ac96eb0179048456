#!/usr/bin/env bash
# run.sh TARGET CORPUS: RCS_FUZZ_SECONDS (60) of fuzzing, from new seeds (CORPUS.seeds) and the
# inputs found by earlier runs (CORPUS). An input that caused a failure is CORPUS.crash-* or .timeout-*.
set -euo pipefail
target=$1
corpus=$2
mkdir -p "$corpus"
"$target" -seeds="$corpus.seeds"
exec "$target" -max_total_time="${RCS_FUZZ_SECONDS:-60}" -timeout=2 -malloc_limit_mb=200 -rss_limit_mb=1024 \
  -max_len=8192 -entropic=0 -dict="$(dirname "${BASH_SOURCE[0]}")/values.dict" \
  -artifact_prefix="$corpus." -print_final_stats=1 "$corpus" "$corpus.seeds"
