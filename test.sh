#!/usr/bin/env bash
# Builds everything and runs the tests. Arguments go to ctest: ./test.sh -L motion, ./test.sh -R Newmark
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

scripts/setup.sh tests
launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset release "${launcher[@]}"
cmake --build --preset release -j "${PLIANT_JOBS:-2}"
ctest --preset release -j "${PLIANT_JOBS:-2}" "$@"
