"""Notebooks run from the first cell to the last, with choices that take less time."""
import json
import os
import pathlib
import subprocess
import sys

import pytest

from conftest import QUICK, ROOT

NOTEBOOKS = ROOT / "python/notebooks"
SHORT = {
    "fit_a_recording": {"settings": QUICK},
    "plan_a_recording": {"rates": [20.0, 30.0]},
    "posterior_samples": {"settings": QUICK, "count": 3},
    "torch_training_loop": {"iterations": 3},
}
NEEDS = {"torch_training_loop": "torch"}


def test_each_is_run():
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(SHORT)


@pytest.mark.parametrize("name", sorted(SHORT))
def test_runs(name, tmp_path):
    pytest.importorskip("matplotlib", reason="Matplotlib is not installed")
    if name in NEEDS:
        pytest.importorskip(NEEDS[name], reason=f"{NEEDS[name]} is not installed")
    cells = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text())["cells"]
    lines = ["import matplotlib", "matplotlib.use('Agg')", "__builtins__.display = print"]
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        lines.append("".join(cell["source"]))
        if "parameters" in cell["metadata"].get("tags", []):
            assert all(f"{key} =" in lines[-1] for key in SHORT[name]), "a choice that the notebook does not have"
            lines += [f"{key} = {value!r}" for key, value in SHORT[name].items()]
            if "out =" in lines[-1 - len(SHORT[name])]:
                lines.append(f"out = pathlib.Path({str(tmp_path)!r})")
    (tmp_path / "cells.py").write_text("\n\n".join(lines))
    done = subprocess.run([sys.executable, tmp_path / "cells.py"], cwd=NOTEBOOKS, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
