#!/usr/bin/env python3
"""What a time step costs against the size of the body: a table (Markdown) and a plot (SVG).

    python3 benchmarks/motion/size_benchmark.py build/release/benchmarks/size_benchmark --out out/sizes --threads 2

A process for each size, so that memory is that size's alone. `--table FILE.csv` draws what was measured before. Standard library only."""
import argparse
import csv
import io
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
import plots

COLUMNS = ("case", "solver", "threads", "nodes", "elements", "dt_s", "body_s", "processor_s", "wall_s", "iterations",
           "resident_bytes", "peak_bytes", "body_bytes")
NAMES = {"torus": "soft torus of hexahedra, on a plane", "bar": "bar of tetrahedra, 1 MPa", "stiff_bar": "the same, 100 MPa"}
IN_PLOT = {"torus": "torus of hexahedra", "bar": "bar, 1 MPa", "stiff_bar": "bar, 100 MPa"}
GOALS = {1e5: 3.0, 1e6: 45.0}  # [s] a step


def measure(program, case, nodes, options):
    command = [program, "--case", case, "--nodes", str(nodes), "--threads", str(options.threads), "--solver", options.solver,
               "--steps", str(options.steps)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"{case}, {nodes} nodes: {done.stderr.strip()}", file=sys.stderr)
        return None
    print(done.stdout.strip(), flush=True)
    return dict(zip(COLUMNS, next(csv.reader(io.StringIO(done.stdout)))))


def table(rows):
    lines = ["| | nodes | elements | step, processor [s] | iterations | memory a node [kB] |", "| --- | --- | --- | --- | --- | --- |"]
    for row in rows:
        lines.append(f"| {NAMES[row['case']]} | {int(row['nodes']):,} | {int(row['elements']):,} | {float(row['processor_s']):.3g} "
                     f"| {float(row['iterations']):.3g} | {float(row['peak_bytes']) / 1e3:.1f} |")
    return "\n".join(lines) + "\n"


def draw(rows, path):
    panel = plots.Panel(70, 20, 560, 360, (2.7, 6.3), (-3.2, 2.3))
    panel.axes("nodes", "processor time a step [s]")
    for number, case in enumerate(dict.fromkeys(row["case"] for row in rows)):
        points = sorted((float(r["nodes"]), float(r["processor_s"])) for r in rows if r["case"] == case)
        panel.line(points, plots.COLOURS[number], IN_PLOT[case], number)
    for nodes, seconds in GOALS.items():
        panel.cross(nodes, seconds)
    plots.write(path, 660, 440, panel.parts)
    path.write_text(plots.made[path])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", nargs="?", help="size_benchmark")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--table", type=pathlib.Path, help="a table of an earlier run, in the place of a program")
    parser.add_argument("--cases", nargs="+", default=list(NAMES), choices=list(NAMES))
    parser.add_argument("--nodes", nargs="+", type=int, default=[1000, 10000, 100000, 1000000])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--steps", type=int, default=3)
    parser.add_argument("--solver", default="automatic")
    options = parser.parse_args()
    if not options.program and not options.table:
        parser.error("a program to measure, or --table")
    options.out.mkdir(parents=True, exist_ok=True)
    if options.table:
        rows = list(csv.DictReader(options.table.open()))
    else:
        rows = [row for case in options.cases for nodes in options.nodes if (row := measure(options.program, case, nodes, options))]
        with (options.out / "sizes.csv").open("w") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    (options.out / "sizes.md").write_text(table(rows))
    draw(rows, options.out / "sizes.svg")
    return 0 if rows else 1


if __name__ == "__main__":
    sys.exit(main())
