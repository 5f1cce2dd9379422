"""The code of docs/analysis.md and the suite of docs/suites.md, executed; data frames."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from vessel_hsmc_ros.bags.run_to_bag import write_bag
from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.report import page
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop, simulate
from vessel_hsmc_ros.studies.comparison import Task, compare
from vessel_hsmc_ros.studies.suite import KEYS, load_suite

DOCS = Path(__file__).parents[3] / "docs"


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in one language."""
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_examples_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for law in ("guided", "los_pid"):
        scenario = load_scenario("case2_tracking", {"vessel_sim.duration": 3.0, "controller.law": law})
        loop = ClosedLoop(scenario)
        loop.run()
        write_bag(Path("runs") / law / "bag", loop.published(), scenario)
    for block in blocks("analysis.md", "python"):
        exec(block, {})  # noqa: S102 - our own documentation
    printed = capsys.readouterr().out
    assert "los_pid" in printed  # a column of the description
    assert "std" in printed
    assert "yaw_surface" in printed
    assert "\n0.5 " in printed  # a point of the sweep with its mean


def test_data_frames_have_the_columns_of_the_exported_tables() -> None:
    changes = {"vessel_sim.duration": 1.0, "vessel_sim.rate_hz": 100.0}
    run = simulate(load_scenario("realistic", changes))
    motion, control = run.to_dataframe(), run.control_dataframe()
    tables = page.tables(run)
    assert ["time", *motion.columns] == list(tables["motion"])
    assert {"time", *control.columns} == set(tables["control"])
    np.testing.assert_array_equal(motion.index, run.time)
    np.testing.assert_array_equal(motion["reference_x"], run.reference[:, 0])
    assert {"measured_x", "disturbance_surge_acceleration", "position_error"} <= set(motion.columns)
    joined = motion.join(control)  # fails for a name that both have
    assert joined["estimated_x"].count() == len(control) < len(joined)


def test_without_pandas_one_line_names_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": 0.1}))
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InstallationError, match="pip install pandas"):
        run.to_dataframe()


def test_the_suite_of_the_page_is_valid_and_can_be_compared(tmp_path: Path) -> None:
    text, *_ = blocks("suites.md", "yaml")
    path = tmp_path / "my_suite.yaml"
    path.write_text(text, encoding="utf-8")
    rows = load_suite(path)
    assert [row.name for row in rows] == ["circle", "straight with current"]
    assert rows[1].changes["vessel_sim.duration"] == 90.0
    outcomes = compare([Task(row, "guided", 10.0) for row in rows], jobs=1)
    assert [outcome.hit for outcome in outcomes] == [True, True]


def test_the_page_names_every_key_of_a_suite() -> None:
    page = (DOCS / "suites.md").read_text(encoding="utf-8")
    assert [key for key in (*KEYS, "rows") if f"| `{key}` |" not in page] == []
