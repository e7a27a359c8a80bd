#!/usr/bin/env python3
"""Whether two types that other files see share a name: one of them would be taken for the other when the program is linked, which no compiler
says. Unnamed namespaces and types within types are left out. Prints which, and ends with 1 where there are any."""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ("src", "apps", "python", "live", "tests/support", "benchmarks", "experiments")
NAMESPACE = re.compile(r"(?:inline )?namespace ?([\w:]*) ?\{")
TYPE = re.compile(r"(?:struct|class|enum class|union) (?:\[\[\w+\]\] )?(\w+)(?: final)?(?: : .*)?(?: \{.*)?$")


def types_of(text):
    """Full names of the types that a file defines."""
    within = []
    for line in text.splitlines():
        if begun := NAMESPACE.match(line):
            within.append(begun[1])
        elif line.startswith("}  // namespace"):
            within.pop()
        elif (found := TYPE.match(line)) and "" not in within and not line.endswith(";"):
            yield "::".join([*within, found[1]])


def shared_names(files):
    """Names that several files define, with the files: (path, text) each."""
    places = collections.defaultdict(set)
    for path, text in files:
        for name in types_of(text):
            places[name].add(path)
    return {name: sorted(at) for name, at in sorted(places.items()) if len(at) > 1}


def main():
    twice = "namespace pliant {\nstruct One {\n};\n}  // namespace pliant\n"
    hidden = "namespace pliant {\nnamespace {\nstruct One {\n};\n}  // namespace\n}  // namespace pliant\n"
    if list(shared_names([("a", twice), ("b", twice), ("c", hidden)]).items()) != [("pliant::One", ["a", "b"])]:
        sys.exit("this script does not see what it looks for")
    files = [f for folder in FOLDERS for f in (ROOT / folder).rglob("*") if f.suffix in (".hpp", ".cpp")]
    shared = shared_names((str(f.relative_to(ROOT)), f.read_text()) for f in files)
    for name, at in shared.items():
        print(f"{name} is defined in {' and '.join(at)}: rename one of them")
    sys.exit(1 if shared else 0)


if __name__ == "__main__":
    main()
