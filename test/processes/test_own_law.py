"""A control law in a file of one's own: over the real nodes, offline, replayed, compared and evaluated."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness import BIN, exit_code, run_folder

from vessel_hsmc_ros import Run, load_law_file, load_scenario, open_bag, simulate
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import Registry
from vessel_hsmc_ros.report.from_bag import of_bag

Captured = pytest.CaptureFixture[str]

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "my_law.py"
SCENARIO = """
/**/vessel_sim:
  ros__parameters: {duration: 3.0, disturbance: {periodic: {surge_force: 1100.0, frequency: 0.01}}}
/**/reference_ship:
  ros__parameters: {surge_force: 1.0e+5, yaw_moment: 1.0e+6}
/**/controller:
  ros__parameters:
    law: my_law
    my_law: {lookahead: 10.0}
"""
LAW_FILE = ["--law-file", "my_law.py"]
REMEDY = "a law of your own needs --law-file FILE.py on the command line, or its package installed"


Verb = Callable[..., int]


def vessel_hsmc(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command as a process of its own."""
    command = [str(BIN / "vessel-hsmc"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120.0)


@pytest.fixture
def verb(folder: Path, monkeypatch: pytest.MonkeyPatch, laws: Registry) -> Verb:
    """The command in this process; returns its exit code."""
    monkeypatch.chdir(folder)

    def call(*arguments: str) -> int:
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *arguments])
        return exit_code()

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario, its law and the run of the nodes."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copy(EXAMPLE, folder)
    (folder / "circle.yaml").write_text(SCENARIO)
    done = vessel_hsmc(folder, "run", "circle.yaml", "--no-page", *LAW_FILE)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def recorded(folder: Path) -> Path:
    found = run_folder(folder / "runs")
    assert found
    return found


def test_a_law_selected_by_yaml_runs_over_the_nodes_as_offline(folder: Path, recorded: Path, laws: Registry) -> None:
    load_law_file(folder / "my_law.py")
    run, again = open_bag(recorded / "bag").run(), simulate(load_scenario(folder / "circle.yaml"))
    for name in ("time", "state", "reference", "wrench", "disturbance"):
        assert np.array_equal(getattr(run, name), getattr(again, name)), name
    assert np.array_equal(run.control["commanded_heading"], again.control["commanded_heading"])


def test_the_origin_of_the_law_is_recorded_with_the_run(folder: Path, recorded: Path) -> None:
    summary = json.loads((recorded / "run.json").read_text())
    assert summary["law_source"] == str(folder / "my_law.py")
    bag = open_bag(recorded / "bag")
    assert bag.recording["law_source"] == f"{folder / 'my_law.py'} {summary['law_sha256']}"
    assert b"lookahead: 10.0" in bag.attachments["scenario.yaml"]


def test_a_bag_of_an_own_law_is_verified_with_its_file_only(recorded: Path, verb: Verb, capsys: Captured) -> None:
    assert verb("replay", str(recorded / "bag"), "--verify") == 2
    assert capsys.readouterr().err.endswith(f"{REMEDY}\n")
    assert verb("replay", str(recorded / "bag"), "--verify", *LAW_FILE) == 0
    assert "every command is bit-identical" in capsys.readouterr().out


def test_a_changed_file_is_named_when_the_commands_differ(folder: Path, recorded: Path, verb: Verb, capsys: Captured) -> None:
    text = EXAMPLE.read_text(encoding="utf-8").replace("0.1 * p.surge_gain", "0.2 * p.surge_gain")
    (folder / "changed.py").write_text(text, encoding="utf-8")
    assert verb("replay", str(recorded / "bag"), "--verify", "--law-file", "changed.py") == 1
    assert f"recorded with the law of {folder / 'my_law.py'} " in capsys.readouterr().out


def test_the_bag_of_an_own_law_is_evaluated_without_its_code(recorded: Path) -> None:
    record = of_bag(recorded / "bag")
    assert record.scenario
    assert record.scenario.controller.law == "my_law"
    assert np.isfinite(record.run.disturbance).all()


@pytest.mark.long
def test_own_laws_are_compared_in_worker_processes(folder: Path, verb: Verb) -> None:
    arguments = ["--laws", "los_pid,my_law", "--workers", "2", "--set", "vessel_sim.duration=1", "--output", "compared"]
    assert verb("compare", "circle.yaml", *LAW_FILE, *arguments) == 0
    (results,) = (folder / "compared").glob("*/compare.json")
    assert "my_law" in results.read_text()


FAILING = EXAMPLE.read_text(encoding="utf-8").replace("self.integral = 0.0", "self.left = 50; self.integral = 0.0")
FAILING = FAILING.replace("        p, ship", "        self.left -= 1\n        _ = 1 / self.left\n        p, ship")


def test_an_exception_in_a_law_ends_the_run_in_one_line_and_leaves_a_complete_bag(tmp_path: Path) -> None:
    (tmp_path / "my_law.py").write_text(FAILING, encoding="utf-8")
    (tmp_path / "circle.yaml").write_text(SCENARIO)
    line = FAILING.splitlines().index("        _ = 1 / self.left") + 1
    done = vessel_hsmc(tmp_path, "run", "circle.yaml", *LAW_FILE)
    assert done.returncode == 1
    (error,) = [text for text in done.stderr.splitlines() if text.startswith("error: ")]
    expected = f"controller failed: law my_law failed at {tmp_path}/my_law.py:{line}: ZeroDivisionError: division by zero"
    assert error.startswith(f"error: {expected}")
    assert "Traceback" not in done.stderr
    found = run_folder(tmp_path / "runs")
    assert found
    assert open_bag(found / "bag").complete


def test_the_controller_node_names_a_wrong_law_file_and_exits_with_2(start: Any) -> None:
    command = start("controller_node", "--law-file", "missing.py", "--ros-args", "-p", "law:=my_law")
    assert command.wait() == 2
    (line,) = command.text.splitlines()
    assert line.startswith("[FATAL]")
    assert line.endswith("missing.py cannot be read: No such file or directory")


def test_the_example_converges_to_a_circle(laws: Registry) -> None:
    load_law_file(EXAMPLE)
    run = simulate(load_scenario("case2_tracking", {"controller.law": "my_law", "vessel_sim.duration": 100.0}))
    assert largest_error(run, after=80.0) < 0.1


def test_an_instance_of_a_law_replaces_that_of_the_scenario(laws: Registry) -> None:
    load_law_file(EXAMPLE)
    kind = laws["my_law"]
    instance = kind.controller(kind.parameters(lookahead=9.0), KnownVessel(), 0.01)
    given = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": 2.0}), law=instance)
    changes = {"controller.law": "my_law", "controller.my_law.lookahead": 9.0, "vessel_sim.duration": 2.0}
    assert np.array_equal(given.state, simulate(load_scenario("case2_tracking", changes)).state)


def largest_error(run: Run, after: float) -> float:
    """The largest position error after a time, m."""
    error = np.hypot(*(run.state - run.reference)[:, :2].T)
    return float(error[run.time > after].max())
