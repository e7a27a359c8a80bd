#!/usr/bin/env bash
# Builds the module that live pages carry, src/live/page/live.wasm.gz, from the library's own sources, by a pinned compiler (clang by
# the `ziglang` package of Python). Users do not need this: the module stands in the repository.
#   scripts/build_live.sh               builds it anew, and records its hash and those of the sources it was made of
#   scripts/build_live.sh --check       builds it elsewhere and compares the bytes
#   scripts/build_live.sh --recorded    builds nothing: compares the bytes with the recorded hash (1: they differ), and the sources
#                                       with theirs (77: the module is of other sources, which are named)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

page=src/live/page
if [[ ${1:-} == --recorded ]]; then
  (cd "$page" && sha256sum --check --quiet live.wasm.sha256) || exit 1
  sha256sum --check --quiet "$page/live.sources.sha256" && echo "the module is of these sources" && exit
  echo "skipped: the module of live pages is of other sources than these; scripts/build_live.sh makes it anew"
  exit 77
fi

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
# Eigen's small functions are inlined by force: a step takes a sixth less than where clang decides.
export work flags="-target wasm32-wasi -std=c++20 -O3 -g0 -msimd128 -fno-sanitize=all -DNDEBUG -DBOOST_NO_CXX98_FUNCTION_BASE
  -DEIGEN_STRONG_INLINE=__attribute__((always_inline))inline
  -ffile-prefix-map=$PWD=. -Isrc -isystem $work/include"
# A source's object, anew where something that it was made of is newer.
compile() {
  local source=$1 object=$work/objects/${1//\//_}.o needed
  if [[ -f $object && -f ${object%.o}.d && -z ${PLIANT_LIVE_CLEAN:-} ]]; then
    for needed in scripts/build_live.sh $(sed -e 's/^[^:]*://' -e 's/\\$//' "${object%.o}.d"); do
      [[ $needed -nt $object || ! -e $needed ]] && needed= && break
    done
    [[ -n $needed ]] && return
  fi
  read -ra words <<< "${flags//$'\n'/ }"
  "$work/python/bin/python" -m ziglang c++ "${words[@]}" -MD -MF "${object%.o}.d" -c "$source" -o "$object"
}
export -f compile
objects=()
for source in "${sources[@]}"; do
  [[ $source == src/elasticity/modes.cpp ]] && continue # vibrations: Spectra, and no page asks for them
  echo "$source"
  objects+=("$work/objects/${source//\//_}.o")
done > "$work/sources"
xargs -P "${PLIANT_JOBS:-2}" -I '{}' bash -ec 'compile {}' < "$work/sources"
"$work/python/bin/python" -m ziglang c++ -target wasm32-wasi -O3 -mexec-model=reactor -Wl,--gc-sections -Wl,--strip-all \
  -o "$work/live.wasm" "${objects[@]}"
gzip -9 -n -c "$work/live.wasm" > "$work/live.wasm.gz"
if [[ ${1:-} == --check ]]; then
  cmp "$work/live.wasm.gz" "$page/live.wasm.gz"
else
  cp "$work/live.wasm.gz" "$page/live.wasm.gz"
  (cd "$page" && sha256sum live.wasm.gz > live.wasm.sha256)
  for object in "${objects[@]}"; do sed -e 's/^[^:]*://' -e 's/\\$//' "${object%.o}.d"; done | tr ' ' '\n' | grep '^src/' | LC_ALL=C sort -u |
    xargs sha256sum > "$page/live.sources.sha256"
fi
sha256sum "$work/live.wasm.gz"
