#!/usr/bin/env bash
# Builds with the address and undefined-behaviour sanitizers and runs the tests; any finding fails its test. Arguments go to
# ctest; left out: all tests but the slow ones.
#   scripts/sanitize.sh -L motion
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset asan "${launcher[@]}"
cmake --build --preset asan -j "${PLIANT_JOBS:-2}"
[[ $# -gt 0 ]] || set -- -LE slow
ctest --preset asan -j "${PLIANT_JOBS:-2}" "$@"
