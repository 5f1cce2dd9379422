"""`vessel-hsmc demo` over real nodes, with shorter runs than a user's."""

import json
import sys
from pathlib import Path

import pytest
from harness import Command

SHORT = """
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.studies import scenario_run

scenario_run.DURATION = 2.0
cli(["demo"])
"""


@pytest.mark.alone
def test_three_laws_run_over_nodes_and_end_in_one_page_and_one_table(tmp_path: Path) -> None:
    command = Command(
        [sys.executable, "-c", SHORT], tmp_path, {"ROS_DOMAIN_ID": ""}
    )  # in two free domains, if there are two cores
    assert command.wait() == 0, command.text
    (folder,) = (tmp_path / "runs").glob("*_demo")
    for law in ("hierarchical", "hierarchical_printed", "guided"):
        summary = json.loads((folder / law / "run.json").read_text())
        assert (summary["mode"], summary["steps"], summary["missed_periods"]) == ("lockstep", 200, 0)
        assert 0.0 < summary["start_up"] < 60.0
        assert (folder / law / "report.html").is_file()
    assert (folder / "report.html").is_file()
    assert (folder / "figures" / "track.png").is_file()
    assert "position error, final" in command.text
    assert "The paper's law as printed (hierarchical_printed) does not converge" in command.text
    assert "The paper's law, repaired" in command.text
    assert "The guided law" in command.text
    assert f"page: {folder.relative_to(tmp_path) / 'report.html'}" in command.text
