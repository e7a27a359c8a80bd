#!/usr/bin/env bash
# Builds the reference: pages of the Python package from its docstrings, by Sphinx, and of the C++ library from its
# headers, by Doxygen: scripts/build_reference.sh [FOLDER]
# The package is that of build/release/python, or of PYTHONPATH.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
out="${1:-$root/out/reference}"
mkdir -p "$out"
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH="${PYTHONPATH:-$root/build/release/python}" \
  "${PLIANT_PYTHON:-/usr/bin/python3}" -m sphinx -q -W -E -b html "$root/docs/reference" "$out" -d "$out/.doctrees"
doxygen - << END
PROJECT_NAME = pliant
PROJECT_BRIEF = "The C++ library: a module uses only those before it in docs/architecture.md"
INPUT = "$root/src"
FILE_PATTERNS = *.hpp
RECURSIVE = YES
STRIP_FROM_PATH = "$root/src"
STRIP_FROM_INC_PATH = "$root/src"
OUTPUT_DIRECTORY = "$out"
HTML_OUTPUT = cpp
GENERATE_LATEX = NO
EXTRACT_ALL = YES
HIDE_UNDOC_RELATIONS = NO
SORT_MEMBER_DOCS = NO
AUTOLINK_SUPPORT = NO
QUIET = YES
WARNINGS = NO
WARN_IF_DOC_ERROR = NO
WARN_IF_INCOMPLETE_DOC = NO
HAVE_DOT = NO
END
echo "$out/index.html"
