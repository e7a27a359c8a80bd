#!/usr/bin/env python3
"""Whether each module of src includes headers of modules below it alone: of those that its CMakeLists.txt links, and what these
link in turn. All modules share one include path, so that no compiler says where one reaches up. Prints what breaks the rule, and
ends with 1 where anything does."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^#include "(\w+)/', re.MULTILINE)
LINKED = re.compile(r"\bpliant::(\w+)")


def below(module, linked):
    """The modules that a module may include: what it links, directly or through others."""
    found, left = set(), list(linked[module])
    while left:
        if (name := left.pop()) not in found:
            found.add(name)
            left += linked.get(name, ())
    return found


def complaints(linked, included):
    """What breaks the rule. linked: modules by module; included: (path, module) pairs by module."""
    for module in linked:
        may = below(module, linked)
        if module in may:
            yield f"src/{module} links itself through {', '.join(sorted(linked[module]))}: take one of the links away"
        for path, name in included[module]:
            if name != module and name in linked and name not in may:
                yield f"{path} includes a header of src/{name}, which src/{module} does not link: move what both need below them"


def main():
    low_up = list(complaints({"low": set(), "high": {"low"}}, {"low": [("low/a.hpp", "high")], "high": [("high/a.hpp", "low")]}))
    if len(low_up) != 1 or not low_up[0].startswith("low/a.hpp") or not list(complaints({"a": {"a"}}, {"a": []})):
        sys.exit("this script does not see what it looks for")
    modules = sorted(f.parent.name for f in (ROOT / "src").glob("*/CMakeLists.txt"))
    linked = {m: set(LINKED.findall((ROOT / "src" / m / "CMakeLists.txt").read_text())) for m in modules}
    sources = {m: [f for f in (ROOT / "src" / m).rglob("*") if f.suffix in (".hpp", ".cpp")] for m in modules}
    included = {m: [(str(f.relative_to(ROOT)), name) for f in files for name in INCLUDE.findall(f.read_text())] for m, files in sources.items()}
    found = list(complaints(linked, included))
    print("\n".join(found), end="\n" if found else "")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
