#!/usr/bin/env bash
# Builds pliant and fits the example recording. Arguments go to `pliant fit`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

scripts/setup.sh
launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset release "${launcher[@]}"
cmake --build --preset release --target pliant -j "${PLIANT_JOBS:-2}"

build/release/apps/pliant fit examples/oracle-bounce-a --out out/demo "$@"

cat << 'END'

Look at
  out/demo/report.html      what was found, in one page
  out/demo/result.json      the same for programs
  out/demo/model.toml       the model, ready to be simulated
  out/demo/trajectory.pvd   the simulated motion, for ParaView
The truth of this recording is in examples/oracle-bounce-a/truth.json; the fit never reads it.
END
