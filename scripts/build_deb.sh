#!/usr/bin/env bash
# Builds a Debian package of the program, for every processor of this kind: scripts/build_deb.sh [FOLDER]
# `apt install ./pliant_*.deb` puts it on a machine with what it needs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out="$(realpath -m "${1:-out/deb}")"

scripts/setup.sh
launcher=()
command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S . -B build/package -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DPLIANT_BUILD_TESTS=OFF -DPLIANT_WITH_PYTHON=OFF "${launcher[@]}"
cmake --build build/package --target pliant -j "${PLIANT_JOBS:-2}"
mkdir -p "$out"
(cd build/package && CMAKE_INSTALL_PARALLEL_LEVEL=1 cpack -G DEB -D CPACK_CMAKE_GENERATOR=Ninja -B "$out")
rm -rf "$out/_CPack_Packages"
ls "$out"/*.deb
