"""The command `pliant`."""
import sys

from . import _pliant


def main():
    sys.exit(_pliant.command(["pliant", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
