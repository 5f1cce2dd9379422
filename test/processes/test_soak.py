"""A short soak: two minutes of ship time, and what the evaluation of a soak finds."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SOAK = Path(__file__).parents[2] / "benchmarks" / "soak.py"


@pytest.fixture(scope="module")
def soak() -> Any:
    spec = importlib.util.spec_from_file_location("soak", SOAK)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.alone
def test_over_two_minutes_of_ship_time_no_node_grows_misses_a_period_or_loses_a_message(tmp_path: Path) -> None:
    """The bound is generous, as the run is short; a queue that is never emptied exceeds it nevertheless."""
    picture = tmp_path / "soak.png"
    command = [sys.executable, str(SOAK), "--duration", "120", "--growth", "10", "--picture", str(picture)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    for node in ("recorder", "controller", "reference", "vessel_sim"):
        assert node in done.stdout


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({}, ""),
        ({"memory": 0.5}, "memory grows by"),
        ({"files": 1}, "files grow from"),
        ({"threads": 1}, "threads grow from"),
    ],
)
def test_a_leak_of_memory_files_or_threads_is_found(soak: Any, change: dict[str, float], problem: str) -> None:
    start = {"memory": 80.0, "own": 60.0, "files": 20, "threads": 16}
    samples = [
        soak.Sample(float(k), **{name: value + k * change.get(name, 0) for name, value in start.items()}) for k in range(100)
    ]
    found = soak.found(soak.settled(samples), allowed=1.0)
    assert len(found) == bool(problem)
    assert all(text.startswith(problem) for text in found)


def test_memory_that_grows_while_the_node_starts_is_no_leak(soak: Any) -> None:
    samples = [soak.Sample(float(k), min(80.0, 10.0 + 10.0 * k), 10.0, 20, 16) for k in range(100)]
    assert soak.found(soak.settled(samples), allowed=1.0) == []
