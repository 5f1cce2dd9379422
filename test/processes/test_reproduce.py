"""`vessel-hsmc reproduce`: the nodes give the same numbers as the offline loop."""

import dataclasses
import subprocess
from pathlib import Path

import pytest
from harness import BIN

from vessel_hsmc_ros.studies.paper import reproduction
from vessel_hsmc_ros.studies.paper.cases import CASES

SHORT = [
    dataclasses.replace(case, changes={**case.changes, "vessel_sim.duration": 1.5})
    for case in CASES
    if case.name in ("circle", "circle_exact")
]


@pytest.mark.long
def test_the_nodes_reproduce_the_numbers_of_the_offline_loop(tmp_path: Path) -> None:
    progress: list[float] = []
    by_nodes = reproduction.run_cases(SHORT, tmp_path / "nodes", progress.append)
    offline = reproduction.run_cases(SHORT, None, lambda _: None)
    assert sorted(path.name for path in (tmp_path / "nodes").iterdir()) == ["circle"]
    assert progress == sorted(progress)
    for name, result in offline.items():
        assert repr(by_nodes[name].numbers) == repr(result.numbers)


def test_help_describes_the_verb_and_its_options() -> None:
    done = subprocess.run([BIN / "vessel-hsmc", "reproduce", "--help"], capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0
    assert "--ros" in done.stdout
    assert "Repeat every case and figure of the paper" in done.stdout
