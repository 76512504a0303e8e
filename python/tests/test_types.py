"""The stubs say what the package does: the strict type checker finds no fault in it, nor in a user's lines."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy", reason="mypy is not installed: types are NOT checked (make test-python has it)")

HERE = Path(__file__).parent


@pytest.mark.parametrize("what", [["-p", "misclosure"], [str(HERE / "typed_use.py")]])
def test_the_type_checker_finds_nothing(what, tmp_path):
    strictly = ["--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path)]
    command = [sys.executable, "-m", "mypy", *strictly, *what]
    checked = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr
