#!/bin/bash
# results_test.sh SOURCE_DIR BUILD_DIR BIN_DIR: every requirement has a verification that exists, and
# the documents agree with the table of tools/results: each group has a requirement and a command,
# each command is a program with these options, an existing file, or a selection of tests that is
# not empty; docs/requirements.md is current, and docs/results.md has one row for each requirement.
set -u
source=$1
build=$2
bin=$3
cd "$source" || exit 1
failures=0
fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
listed=$(tools/results --list) || fail "tools/results --list" # it knows the group of each requirement
tools/results --documents "$fresh" || fail "tools/results --documents"
for page in requirements.md results.md; do
  diff "$fresh/$page" "docs/$page" || fail "docs/$page is not current: tools/results --documents"
done
rows_of() { grep -c '^| [A-Z][0-9]* |' "$1"; }
[ "$(rows_of docs/requirements.md)" -eq "$(rows_of docs/results.md)" ] || fail "docs/results.md has other rows"
groups=$(awk '{print $1}' <<<"$listed")
[ "$(wc -w <<<"$groups")" -ge 10 ] || fail "only the groups $groups"
for group in $groups; do
  grep -q "^| [A-Z][0-9]* .*\`tools/results $group\`" docs/requirements.md || fail "group $group verifies no requirement"
done
tools/results no_such_group 2>/dev/null && fail "an unknown group was accepted"

# The commands. "A && B" are two; variables are those of the table.
check_ctest() { # ARGUMENTS
  local found
  found=$(ctest --test-dir "$build" -N "$@" 2>&1 | sed -n 's/^Total Tests: //p')
  [ "${found:-0}" -gt 0 ] || fail "no test: ctest $*"
}
check_rcs() { # SUB-COMMAND [ARGUMENTS]
  local help word sub=("$1")
  case $1 in import | map | log) sub+=("$2") ;; esac
  help=$("$bin/rcs" "${sub[@]}" --help 2>&1) || { fail "rcs ${sub[*]}"; return; }
  for word in "${@:2}"; do
    case $word in
      -*) grep -qE -- "(^|[ ,])$word([ ,]|$)" <<<"$help" || fail "rcs ${sub[*]} has no option $word" ;;
      *FILE*) ;; # each item of the group
      *.toml) [ -e "$word" ] || fail "no file $word" ;;
    esac
  done
}
while IFS= read -r line; do
  command=$(sed -E 's/^[a-z0-9_]+ +about +[0-9]+ min +//; s/>&2//g' <<<"$line")
  items=$(sed -n 's/.*, FILE: each of //p' <<<"$command")
  command=${command%%, FILE: *}
  for item in $items; do
    if [[ $command == ctest* || $command == *=*ctest* ]]; then
      check_ctest -L drill -R "^$item"
    else
      # A pattern that matches is expanded; others are the beginning of paths.
      [ -e "$item" ] || compgen -G "$item*.toml" >/dev/null || fail "no file $item"
    fi
  done
  while IFS= read -r one; do
    eval "words=($(sed 's/\$/\\$/g' <<<"$one"))"
    while [[ ${words[0]} == *=* ]]; do words=("${words[@]:1}"); done
    case ${words[0]} in
      ctest)
        rest=()
        for ((k = 1; k < ${#words[@]}; ++k)); do
          case ${words[k]} in --test-dir) ((++k)) ;; -V) ;; *) rest+=("${words[k]}") ;; esac
        done
        [ -n "$items" ] || check_ctest "${rest[@]}"
        ;;
      */rcs) check_rcs "${words[@]:1}" ;;
      tools/*)
        [ -x "${words[0]}" ] || fail "no program ${words[0]}"
        "${words[0]}" --help >/dev/null || fail "${words[0]} --help"
        ;;
      *) fail "unknown kind of command: $one" ;;
    esac
  done < <(sed 's/ *&& */\n/g' <<<"$command")
done <<<"$listed"

# Selections of tests in the documents.
while IFS= read -r line; do
  read -ra words <<<"$line"
  rest=()
  for ((k = 1; k < ${#words[@]}; ++k)); do
    case ${words[k]} in --test-dir) ((++k)) ;; -V) ;; *) rest+=("${words[k]}") ;; esac
  done
  check_ctest "${rest[@]}"
done < <(grep -hoE '(`ctest|`tools/test|^ctest|^tools/test) [^`#]*' README.md docs/user/*.md docs/experiments/*/*.md | tr -d "\`'\"" | sort -u)

[ $failures -eq 0 ] || exit 1
echo "results_test: passed: $(rows_of docs/requirements.md) requirements, $(wc -w <<<"$groups") groups"
