#!/usr/bin/env bash
# Builds everything and runs the tests. Arguments go to ctest: ./test.sh -L motion, ./test.sh -R Newmark
# ./test.sh quick: the cases of 0.3 s at most, each program of them once, without installing anything.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

jobs="${PLIANT_JOBS:-2}"
[ "${1:-}" = quick ] || scripts/setup.sh tests
launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset release "${launcher[@]}"
cmake --build --preset release -j "$jobs"

if [ "${1:-}" = quick ]; then
  quick() { # one program of tests; tests/slow.txt has the names of cases as CTest has them, MODULE/SUITE.CASE
    local module slow
    module="$(basename "$1" _test)"
    slow="$(sed -n "s|^$module/||p" tests/slow.txt | paste -sd:)"
    "$1" --gtest_brief=1 --gtest_filter="-$slow" > "$1.log" 2>&1 || { cat "$1.log"; return 1; }
  }
  export -f quick
  find build/release/tests -path '*/apps' -prune -o -name '*_test' -type f -print0 | xargs -0 -P "$jobs" -I{} bash -c 'quick {}'
  exit
fi

times=build/release/test_times.xml
status=0
ctest --preset release -j "$jobs" --output-junit "$PWD/$times" "$@" || status=$?
scripts/test_times.py "$times"
exit "$status"
