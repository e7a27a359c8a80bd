"""What docs/python.md shows runs as it stands there."""
import os
import re
import subprocess
import sys

import pytest

from conftest import QUICK, ROOT


def test_the_guide_runs(tmp_path, ring_fit):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.S)
    assert len(blocks) == 3
    code = "\n".join(blocks).replace('"out/', f'"{tmp_path}/').replace(f'"{tmp_path}/ring")', f'"{tmp_path}/ring", settings={QUICK!r})')
    assert "settings={'cells'" in code
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "strength@1" in done.stdout
