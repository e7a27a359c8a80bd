#!/usr/bin/env bash
# Runs clang-tidy as .clang-tidy says. Names are source files or folders; left out: the whole tree.
#   scripts/tidy.sh src/motion tests/motion
# A build folder of its own in which nothing is built: clang cannot read headers that GCC has precompiled.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v clang-tidy > /dev/null; then
  echo "tidy: clang-tidy is missing: apt-get install clang-tidy" >&2
  exit 1
fi
cmake --preset release -B build/tidy -DCMAKE_UNITY_BUILD=OFF > /dev/null

names=("$@")
[[ $# -gt 0 ]] || names=(src apps tests benchmarks experiments)
mapfile -t files < <(find "${names[@]}" -name '*.cpp' | sort)
if [[ ${#files[@]} -eq 0 ]]; then
  echo "tidy: no .cpp file in ${names[*]}" >&2
  exit 1
fi
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "${PLIANT_JOBS:-2}" clang-tidy --quiet -p build/tidy \
  2> >(grep -v ' generated\.$' >&2)
echo "tidy: ${#files[@]} files are clean"
