#!/usr/bin/env bash
# installed_package_test.sh BUILD: another project finds the installed library and registers with
# it; compiled for another instruction set it does not link.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cmake --install "$1" --component registration --prefix "$folder/installed" >/dev/null
# The default generator needs make, which a machine with ninja may not have.
generator=$(sed -n "s/^CMAKE_GENERATOR:INTERNAL=//p" "$1/CMakeCache.txt")
cmake -G "$generator" -S "$here" -B "$folder/build" -DCMAKE_PREFIX_PATH="$folder/installed" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$folder/build" >/dev/null
"$folder/build/registers_two_clouds"

# Without -march the compiler aligns to 16 bytes.
library=$(find "$folder/installed" -name libregistration.a)
symbols=$(nm -C "$library") # no pipe: grep -q would end nm, which pipefail takes for a failure
if grep -q 'BuiltWithAlignment<16>' <<<"$symbols"; then exit 0; fi
if g++ -std=c++17 -O2 -I "$folder/installed/include/rcs" -I /usr/include/eigen3 \
  "$here/registers_two_clouds.cpp" "$library" \
  "$(find "$folder/installed" -name librcs_base.a)" -lGeographicLib -o "$folder/mismatch" 2>"$folder/errors"; then
  echo "a program without the library's -march links" >&2
  exit 1
fi
grep -q BuiltWithAlignment "$folder/errors" || { cat "$folder/errors" >&2; exit 1; }
