# needs SUBJECT PROGRAM...: for the begin of a test script. Without one of the programs it ends with
# status 77, which counts as skipped.
needs() {
  local subject=$1 program
  shift
  for program in "$@"; do
    command -v "$program" >/dev/null && continue
    echo "SKIPPED, NOT TESTED: $subject: no $program; tools/setup --all installs it" >&2
    exit 77
  done
}
