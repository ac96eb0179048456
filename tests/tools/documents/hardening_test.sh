#!/bin/sh
# hardening_test.sh BIN_DIR UNIT...: each program is position-independent, resolves its symbols before
# it begins and makes them read-only, has a stack that cannot be executed, and checks its stack frames
# and the sizes of buffers. Each systemd unit is exposed by at most 3.0 (systemd-analyze security).
set -u
bin=$1
shift
failed=0
complain() {
  echo "FAILED: $*"
  failed=1
}
command -v readelf >/dev/null || { echo "SKIPPED: no readelf"; exit 77; }
printf '%-10s %-4s %-9s %-6s %-6s %s\n' program PIE BIND_NOW RELRO canary fortify
for name in rcs rcs_view sp wm bg mission gateway ros2_bridge sim; do
  [ "$name" != rcs_view ] || [ -e "$bin/$name" ] || continue # built only with Boost
  program=$bin/$name
  header=$(readelf -hW "$program")
  segments=$(readelf -lW "$program")
  dynamic=$(readelf -dW "$program")
  symbols=$(readelf -sW --dyn-syms "$program")
  yes() { if echo "$1" | grep -q -- "$2"; then echo yes; else echo no; fi; }
  pie=$(yes "$header" 'Type: *DYN')
  now=$(yes "$dynamic" 'FLAGS.*NOW')
  relro=$(yes "$segments" GNU_RELRO)
  canary=$(yes "$symbols" __stack_chk_fail)
  fortify=$(yes "$symbols" '_chk\(@\|$\| \)')
  printf '%-10s %-4s %-9s %-6s %-6s %s\n' "$name" "$pie" "$now" "$relro" "$canary" "$fortify"
  [ "$pie $now $relro $canary $fortify" = "yes yes yes yes yes" ] || complain "$name is not hardened"
  echo "$segments" | grep GNU_STACK | grep -q 'RW ' || complain "$name has an executable stack"
done
command -v systemd-analyze >/dev/null || { echo "systemd-analyze is missing: units not examined"; exit $failed; }
for unit in "$@"; do
  result=$(systemd-analyze security --offline=yes --threshold=30 --no-pager "$unit" 2>&1) ||
    complain "$unit is exposed by more than 3.0"
  echo "$result" | grep -i 'overall exposure'
done
exit $failed
