"""The pages of the package are built from its docstrings without a warning, and hold all that is public."""
import os
import subprocess
import sys

import pytest

import pliant
from conftest import ROOT


def test_pages_hold_all_that_is_public(tmp_path):
    pytest.importorskip("sphinx", reason="Sphinx is not installed")
    done = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "-E", "-b", "html", ROOT / "docs/reference", tmp_path / "pages", "-d", tmp_path / "trees"],
                          capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "pages/python.html").read_text()
    for name in pliant.__all__:
        assert f'id="pliant.{name}"' in page, name
