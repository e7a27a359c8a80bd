#!/usr/bin/env bash
# Installs the Debian packages of scripts/debian-packages.txt that are missing, with `tests`, `mpi` or `fuzz` those of
# scripts/debian-packages-tests.txt and so on, too. Quick when all are there.
set -euo pipefail

folder="$(dirname "${BASH_SOURCE[0]}")"
lists=("$folder/debian-packages.txt")
for more in "$@"; do
  case "$more" in
    tests | mpi | fuzz) lists+=("$folder/debian-packages-$more.txt") ;;
    *)
      echo "setup: found $more; expected nothing, tests, mpi or fuzz" >&2
      exit 2
      ;;
  esac
done
mapfile -t wanted < <(sed -e 's/#.*//' -e '/^[[:space:]]*$/d' "${lists[@]}")

if ! command -v dpkg-query > /dev/null; then
  echo "setup: this is no Debian; install the counterparts of ${lists[*]} by hand" >&2
  exit 0
fi

is_installed() { [[ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2> /dev/null)" == installed ]]; }

missing=()
for package in "${wanted[@]}"; do
  is_installed "$package" || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

as_root=()
if [[ "$(id -u)" -ne 0 ]]; then
  if ! command -v sudo > /dev/null; then
    echo "setup: these packages are missing, and neither root nor sudo is at hand: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "setup: installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "${missing[@]}"
