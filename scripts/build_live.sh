#!/usr/bin/env bash
# Builds the module that live pages carry, src/live/page/live.wasm.gz, from the library's own sources, by a pinned compiler (clang by
# the `ziglang` package of Python). Users do not need this: the module stands in the repository.
#   scripts/build_live.sh            builds it anew
#   scripts/build_live.sh --check    builds it elsewhere and compares the bytes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

compiler_version=0.17.1
work=${PLIANT_LIVE_BUILD:-build/live}
mkdir -p "$work/include" "$work/objects"
[[ -x $work/python/bin/python ]] || python3 -m venv "$work/python"
"$work/python/bin/python" -m ziglang version 2> /dev/null | grep -qx "$compiler_version" ||
  "$work/python/bin/pip" install --quiet "ziglang==$compiler_version"
for name in eigen3/Eigen eigen3/unsupported boost; do ln -sfn "/usr/include/$name" "$work/include/$(basename "$name")"; done

sources=(src/base/{error,dense,parallel}.cpp src/geometry/{signed_distance,triangle_mesh,surface_distance}.cpp
  src/mesh/{hex_grid,tet_mesh,tet_shape}.cpp src/parameters/*.cpp src/solvers/*.cpp src/elasticity/*.cpp src/motion/*.cpp
  src/scene/region.cpp src/live/{live_data,live_motion,live_object,live_press}.cpp src/live/wasm/*.cpp)
flags=(-target wasm32-wasi -std=c++20 -O3 -msimd128 -DNDEBUG -DBOOST_NO_CXX98_FUNCTION_BASE
  -ffile-prefix-map="$PWD=." -Isrc -isystem "$work/include")
# An object is current where nothing that it was made of is newer.
is_current() {
  local object=$1 needed
  [[ -f $object && -f ${object%.o}.d && -z ${PLIANT_LIVE_CLEAN:-} ]] || return 1
  for needed in $(sed -e 's/^[^:]*://' -e 's/\\$//' "${object%.o}.d"); do
    [[ $needed -nt $object || ! -e $needed ]] && return 1
  done
  return 0
}
compile() {
  local source=$1 object
  object=$work/objects/${source//\//_}.o
  is_current "$object" || "$work/python/bin/python" -m ziglang c++ "${flags[@]}" -MD -MF "${object%.o}.d" -c "$source" -o "$object"
  echo "$object"
}
objects=()
for source in "${sources[@]}"; do
  [[ $source == src/elasticity/modes.cpp ]] && continue # vibrations: Spectra, and no page asks for them
  objects+=("$(compile "$source")")
done
"$work/python/bin/python" -m ziglang c++ -target wasm32-wasi -O3 -mexec-model=reactor -Wl,--gc-sections -Wl,--strip-all \
  -o "$work/live.wasm" "${objects[@]}"
gzip -9 -n -c "$work/live.wasm" > "$work/live.wasm.gz"
if [[ ${1:-} == --check ]]; then
  cmp "$work/live.wasm.gz" src/live/page/live.wasm.gz
else
  cp "$work/live.wasm.gz" src/live/page/live.wasm.gz
fi
sha256sum "$work/live.wasm"
