#!/usr/bin/env bash
# Feeds readers of files with ever new bytes under the address and undefined-behaviour sanitizers, by clang's libFuzzer, for
# SECONDS each (60 where left out): all readers, or those named. Ends with 1 where one fails, hangs or takes too much memory; what
# made it do so is kept in the folder that the last line names.
#   scripts/fuzz.sh 300 ply zip
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=60
if [[ "${1:-}" =~ ^[0-9]+$ ]]; then
  seconds="$1"
  shift
fi

# Clang before 16 cannot read the ranges of GCC's library.
compiler=""
for name in clang++ clang++-{19..16}; do
  version="$("$name" -dumpversion 2> /dev/null || echo 0)"
  if [[ "${version%%.*}" -ge 16 ]]; then
    compiler="$name"
    break
  fi
done
for name in llvm-symbolizer llvm-symbolizer-{19..16}; do # without it logs have addresses in the place of lines
  [[ -n "${ASAN_SYMBOLIZER_PATH:-}" ]] || ASAN_SYMBOLIZER_PATH="$(command -v "$name" || true)"
done
export ASAN_SYMBOLIZER_PATH
if [[ -z "$compiler" ]]; then
  echo "fuzz: clang of version 16 or later is missing: scripts/setup.sh fuzz" >&2
  exit 1
fi
launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset fuzz -DCMAKE_CXX_COMPILER="$compiler" "${launcher[@]}" > /dev/null
cmake --build --preset fuzz -j "${PLIANT_JOBS:-2}"

program=build/fuzz/tests/fuzz/pliant_fuzz
mapfile -t readers < <("$program" --list)
[[ $# -gt 0 ]] && readers=("$@")
failed=()
for reader in "${readers[@]}"; do
  found="build/fuzz/corpus/$reader" faults="build/fuzz/findings/$reader"
  mkdir -p "$found" "$faults"
  known=("tests/fuzz/corpus/$reader")
  [[ -d "tests/fuzz/findings/$reader" ]] && known+=("tests/fuzz/findings/$reader")
  echo "fuzz: $reader, $seconds s"
  "$program" --reader="$reader" "$found" "${known[@]}" -max_total_time="$seconds" -max_len=16384 -timeout=10 \
    -rss_limit_mb=1024 -malloc_limit_mb=256 -artifact_prefix="$faults/" -print_final_stats=1 -verbosity=0 2> "$faults.log" \
    || failed+=("$reader")
done
if [[ ${#failed[@]} -gt 0 ]]; then
  echo "fuzz: failed: ${failed[*]}; inputs and logs: build/fuzz/findings"
  exit 1
fi
echo "fuzz: no finding in ${#readers[@]} readers"
