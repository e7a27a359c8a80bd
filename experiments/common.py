"""What every experiment needs: run the program, time it, and keep figures as JSON. Standard library only."""
import argparse
import ast
import base64
import csv
import json
import math
import os
import pathlib
import platform
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEFAULT_PROGRAM = ROOT / "build/release/apps/pliant"
INTERRUPTED = 130  # exit code of a command that was asked to stop
_begin = time.monotonic()
_program = None  # that `arguments` were given


def arguments(description, **more):
    """Arguments that all experiments share: the program, and where its large files go."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("program", nargs="?", type=pathlib.Path, default=DEFAULT_PROGRAM, help="the pliant binary")
    parser.add_argument("--work", type=pathlib.Path, help="folder for captures and fits; a temporary one where left out")
    for name, options in more.items():
        parser.add_argument("--" + name, **options)
    parsed = parser.parse_args()
    global _program
    parsed.program = _program = parsed.program.resolve()
    parsed.work = parsed.work or pathlib.Path(tempfile.mkdtemp(prefix="pliant."))
    parsed.work.mkdir(parents=True, exist_ok=True)
    return parsed


def shared_data():
    """The folder of shared recordings: PLIANT_SHARED_DATA, or beside the source tree."""
    return pathlib.Path(os.environ.get("PLIANT_SHARED_DATA", ROOT.parent / "shared/data"))


def run(program, *words, allowed=(0,), limit=None):
    """Runs a command of the program. Returns its wall time [s], processor time [s] and peak memory [MiB].

    After `limit` seconds it is asked to stop with the best that it has."""
    begin = time.monotonic()
    # In the background of a shell interrupts are ignored, and children inherit that.
    child = subprocess.Popen([str(program), *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                             preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    timer = threading.Timer(limit or 1e6, lambda: child.send_signal(signal.SIGINT))
    timer.daemon = True
    timer.start()
    output = child.stdout.read()
    timer.cancel()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in allowed:
        raise SystemExit(f"pliant {' '.join(map(str, words))} returned {child.returncode}:\n{output[-2000:]}")
    return {"exit_code": child.returncode, "wall_seconds": round(time.monotonic() - begin, 2),
            "processor_seconds": round(usage.ru_utime + usage.ru_stime, 2), "peak_memory_mib": round(usage.ru_maxrss / 1024, 1)}


def settings(choices):
    words = []
    for key, value in choices.items():
        words += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    return words


def fit(program, capture, out, choices=None, threads=None, limit=None, more=()):
    """Fits a capture, for at most about `limit` seconds. Returns the run's figures, the result, and the iterations by stage.

    A fit whose figures are in its folder already is not run again: an experiment that was stopped goes on."""
    words = ["fit", capture, "--out", out, *settings(choices or {}), *more]
    if threads:
        words += ["--threads", threads]
    out = pathlib.Path(out)
    if (out / "figures.json").exists():
        figures = read(out / "figures.json")
    else:
        figures = run(program, *words, allowed=(0, 3) if limit is None else (0, 3, INTERRUPTED), limit=limit)
        (out / "figures.json").write_text(json.dumps(figures))
    if not (out / "result.json").exists():  # the log says why
        raise SystemExit(f"{out}: " + (out / "log.txt").read_text().strip().splitlines()[-1])
    figures["result"] = read(out / "result.json")
    with open(out / "convergence.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    stages = [row["stage"] for row in rows]
    figures["iterations"] = {stage: stages.count(stage) for stage in dict.fromkeys(stages)}
    return figures


def evaluate(program, model, capture, out):
    run(program, "evaluate", model, capture, "-o", out)
    return read(out)


def read(path):
    return json.loads(pathlib.Path(path).read_text())


def number(value, digits=5):
    return None if value is None else float(f"{value:.{digits}g}")


def rounded(values, digits=9):
    """Numbers, or lists of them, to so many digits."""
    return [rounded(v, digits) for v in values] if isinstance(values, (list, tuple)) else float(f"{values:.{digits}g}")


def toml(value):
    """A value as TOML: numbers come back exactly."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(v)}" for key, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, (bool, str, pathlib.Path)):
        return json.dumps(str(value) if isinstance(value, pathlib.Path) else value, ensure_ascii=False)
    return repr(value)


def write_capture(folder, name, **facts):
    """Writes capture.toml into a folder and returns the folder: a dictionary is a table, a list of dictionaries the blocks
    of that name, as docs/formats.md tells. Tables and keys that are None are left out."""
    lines = ['format = "capture/1"', f"name = {toml(name)}"]
    for title, blocks in facts.items():
        for block in blocks if isinstance(blocks, list) else [blocks] if blocks is not None else []:
            lines += ["", f"[[{title}]]" if isinstance(blocks, list) else f"[{title}]"]
            lines += [f"{key} = {toml(value)}" for key, value in block.items() if value is not None]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "capture.toml").write_text("\n".join(lines) + "\n")
    return folder


def machine():
    """What the figures were measured on."""
    model = platform.machine()
    try:
        for line in open("/proc/cpuinfo"):
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    return {"processor": model, "cores": os.cpu_count(), "load": round(os.getloadavg()[0], 1)}


def made_by(script):
    """The command that made figures, when, how long its last run took [s], and the program that it ran, with its commit."""
    command = [pathlib.Path(script).resolve().relative_to(ROOT).as_posix()]
    for word in sys.argv[1:]:  # without the folders of one machine
        command.append(pathlib.Path(word).name if os.sep in word else word)
    program = subprocess.run([str(_program), "--version"], capture_output=True, text=True).stdout.strip() if _program else ""
    return {"command": " ".join(command), "date": time.strftime("%Y-%m-%d"), "seconds": round(time.monotonic() - _begin), "program": program}


def write_results(script, figures):
    """Writes results.json beside an experiment's script, with what made it."""
    path = pathlib.Path(script).resolve().parent / "results.json"
    path.write_text(json.dumps({"machine": machine(), "made_by": made_by(script), **figures}, indent=1, allow_nan=False) + "\n")
    print(path)


def read_array(archive, name):
    """Shape and flat values of an array in an .npz file."""
    data = archive.read(name + ".npy")
    size = struct.unpack_from("<H", data, 8)[0]
    header = ast.literal_eval(data[10:10 + size].decode())
    codes = {"<i2": "h", "<i4": "i", "<f4": "f", "<f8": "d"}
    count = math.prod(header["shape"])
    return header["shape"], struct.unpack_from(f"<{count}{codes[header['descr']]}", data, 10 + size)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def mean(points):
    """The middle of points, a tuple."""
    return tuple(sum(p[d] for p in points) / len(points) for d in range(len(points[0])))


def read_markers(path, names):
    """Frame by frame {marker: (x, y, z) [m]} of a CSV file with the columns MARKER_x_m, MARKER_y_m, MARKER_z_m."""
    with open(path, newline="") as file:
        return [{m: tuple(float(row[f"{m}_{c}_m"]) for c in "xyz") for m in names} for row in csv.DictReader(file)]


def read_vtu(path):
    """Arrays of a VTK file as the program writes it (base64, not compressed) by name, flat."""
    root = xml.etree.ElementTree.parse(path).getroot()
    codes = {"Float64": "d", "Float32": "f", "Int64": "q", "UInt8": "B"}
    found = {}
    for array in root.iter("DataArray"):
        data, code = base64.b64decode(array.text.strip())[8:], codes[array.get("type")]
        found[array.get("Name")] = struct.unpack(f"<{len(data) // struct.calcsize(code)}{code}", data)
    return found


def read_vertices(path):
    """[(x, y, z) [m]] of a PLY mesh as recordings and models have it: x, y, z come first; binary or text."""
    data = pathlib.Path(path).read_bytes()
    head, body = data[:data.index(b"end_header\n")].decode().splitlines(), data[data.index(b"end_header\n") + 11:]
    count = int(next(line for line in head if line.startswith("element vertex")).split()[2])
    kinds = []
    for line in head[head.index(f"element vertex {count}") + 1:]:
        if not line.startswith("property"):
            break
        kinds.append(line.split()[1])
    if head[1].split()[1] == "ascii":
        return [tuple(map(float, line.split()[:3])) for line in body.decode().splitlines()[:count]]
    row = struct.Struct("<" + "".join({"float": "f", "double": "d", "uchar": "B", "int": "i"}[k] for k in kinds))
    return [row.unpack_from(body, i * row.size)[:3] for i in range(count)]


def relative_error(estimate, truth):
    return estimate / truth - 1.0


def median(values):
    ordered = sorted(values)
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])


def log_uniform(random, low, high):
    return math.exp(random.uniform(math.log(low), math.log(high)))


def pyplot():
    """Matplotlib's pyplot that draws into files; None, with a line said, where it is not installed."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot
    except ImportError:
        print("matplotlib is not installed: no picture")
        return None
    return matplotlib.pyplot


def at_rest(program, fit):
    """Nodes of a fit's load-free volume, and how far each moves as the model comes to rest under gravity: coordinates one after the other [m]."""
    moving = ("[timing]", "frame_rate", "frame_count", "start_frame", "substeps", "released", "pulls", "pulled_at")
    still = [line for line in (fit / "model.toml").read_text().splitlines() if not line.startswith(moving)]
    folder = fit / "at-rest"
    folder.mkdir(exist_ok=True)
    (folder / "model.toml").write_text("\n".join(still) + "\n")
    for name in ("surface.ply", "model.vtu"):
        if not (folder / name).exists():
            (folder / name).symlink_to((fit / name).resolve())
    run(program, "simulate", folder / "model.toml", "--out", folder)
    frame = read_vtu(sorted((folder / "frames").glob("*.vtu"))[-1])
    there, moved = frame["points"], frame["displacement [m]"]
    return [tuple(there[3 * n + d] - moved[3 * n + d] for d in range(3)) for n in range(len(there) // 3)], moved
