#!/usr/bin/env python3
"""What the tests took, by CTest's --output-junit: the sum of each module and the longest. --slow FILE: writes the names of those that
took 0.3 s or more, which `./test.sh quick` leaves out."""
import argparse
import collections
import pathlib
import xml.etree.ElementTree as xml

LONGEST = 15
SLOW = 0.3  # [s]


def times_of(path):
    """Seconds by name of each test that ran."""
    return {case.get("name"): float(case.get("time", 0.0)) for case in xml.parse(path).getroot().iter("testcase") if case.get("status") != "disabled"}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=pathlib.Path)
    parser.add_argument("--slow", type=pathlib.Path)
    arguments = parser.parse_args()
    times = times_of(arguments.times)
    by_module = collections.Counter()
    for name, seconds in times.items():
        by_module[name.split("/")[0]] += seconds
    print(f"{len(times)} tests took {sum(times.values()):.0f} s of a core")
    print("by module: " + ", ".join(f"{module} {seconds:.0f}" for module, seconds in by_module.most_common()))
    print("the longest: " + ", ".join(f"{name} {seconds:.0f}" for name, seconds in collections.Counter(times).most_common(LONGEST)))
    if arguments.slow:
        arguments.slow.write_text("".join(name + "\n" for name in sorted(times) if times[name] >= SLOW))


if __name__ == "__main__":
    main()
