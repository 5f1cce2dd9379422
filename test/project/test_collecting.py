"""A test module whose library is missing is skipped alone, also where a plugin imports all modules at their collection."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from durations import rest_long

PLUGIN = """
import runpy

def pytest_pycollect_makemodule(module_path, parent):
    runpy.run_path(str(module_path))
"""


@pytest.mark.parametrize("plugins", rest_long([[], ["eager"]]))
def test_a_module_that_skips_itself_does_not_take_its_folder_along(tmp_path: Path, plugins: list[str]) -> None:
    (tmp_path / "eager.py").write_text(PLUGIN)
    (tmp_path / "test_first.py").write_text("import pytest\npytest.importorskip('nowhere')\n")
    (tmp_path / "test_second.py").write_text("def test_it(): pass\n")
    support = Path(__file__).resolve().parents[1] / "support"
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{support}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    options = [part for name in ("collecting", *plugins) for part in ("-p", name)]
    command = [sys.executable, "-m", "pytest", "-q", "-c", os.devnull, "--rootdir", str(tmp_path), *options, str(tmp_path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120.0, cwd=tmp_path)
    assert "1 passed, 1 skipped" in done.stdout, done.stdout + done.stderr
