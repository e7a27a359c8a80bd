"""What the sections of docs/experiments.md share: figures from results.json, tables, words for numbers. Standard library only."""
import json
import math
import pathlib

import plots

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
IMAGES = ROOT / "docs/images"


def results(name):
    path = HERE / name / "results.json"
    return json.loads(path.read_text()) if path.exists() else None


def machine(figures):
    m = figures["machine"]
    made = figures.get("made_by")
    return (f"{m['cores']} cores ({m['processor']}), shared with other work: load {m['load']} at the end"
            + (f", with {made['program']} on {made['date']}" if made and made["program"] else ""))


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def percent(value, sign=True):
    return f"{100 * value:{'+' if sign else ''}.1f} %"


def with_truth(p, scale=1.0, unit=""):
    text = f"{p['value'] * scale:.4g}"
    if p.get("std"):
        std = p["std"] * scale
        text += f" ± {std:.0f}" if std >= 10 else f" ± {std:.2g}"
    if p.get("truth") is not None:
        text += f" ({p['truth'] * scale:g})"
    return text + unit


def judged(good):
    return "met" if good else "missed"


def tiny(value):
    """Of errors that span decades."""
    return "" if value is None else f"{value:.1e}"


def from_landscape(figures, path):
    """Cost over two moduli, in shades of its logarithm."""
    moduli, costs, truth = figures["landscape"]["moduli"], figures["landscape"]["costs"], figures["landscape"]["truth"]
    log = [math.log10(E) for E in moduli]
    half = 0.5 * (log[1] - log[0])
    span = (log[0] - half, log[-1] + half)
    known = [math.log10(c) for row in costs for c in row if c]
    low, high = min(known), max(known)
    panel = plots.Panel(80, 20, 380, 380, span, span)
    for second, row in zip(log, costs):
        for first, cost in zip(log, row):
            colour = plots.shade((math.log10(cost) - low) / (high - low)) if cost else "#ddd"
            panel.cell((10**(first - half), 10**(first + half)), (10**(second - half), 10**(second + half)), colour)
    panel.axes("modulus at the held end [Pa]", "modulus at the free end [Pa]")
    panel.cross(*truth)
    for i in range(40):
        panel.parts.append(f'<rect x="490" y="{360 - 8 * i}" width="18" height="8.4" fill="{plots.shade(i / 39)}"/>')
    panel.parts.append(f'<text x="514" y="368">{10**low:.1e}</text><text x="514" y="54">{10**high:.1e}</text><text x="490" y="30">cost</text>')
    plots.write(path, 600, 460, panel.parts)
