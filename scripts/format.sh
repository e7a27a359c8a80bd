#!/usr/bin/env bash
# Checks that all C++ is laid out as .clang-format says; with --fix lays it out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

what=(--dry-run -Werror)
[[ "${1:-}" == --fix ]] && what=(-i)
find src apps tests benchmarks experiments -name '*.cpp' -o -name '*.hpp' | xargs clang-format "${what[@]}"
