"""Ctrl-C at nine moments: exit code 130, "interrupted", no traceback; and what a run has achieved by then is kept."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import bag_making
import pytest
from durations import rest_long
from harness import BIN, Command, children, command_line, executable, run_folder

Start = Callable[..., Command]
Moment = Callable[[Command], object]

SIMULATE = ["simulate", "case2_tracking", "--set", "vessel_sim.duration=10000"]
RUN = ["run", "case2_tracking"]


def imports(module: str) -> Moment:
    """The moment at which a module is being imported."""
    pattern = re.compile(rf"import time:.*\|\s+{re.escape(module)}$", re.MULTILINE)
    return lambda command: pattern.search(command.text)


def prints(text: str) -> Moment:
    """The moment at which a text has been printed."""
    return lambda command: text in command.text


def runs(module: str) -> Moment:
    """The moment at which a child process of the command runs a module."""
    return lambda command: any(module in " ".join(command_line(pid)) for pid in children(command.popen.pid))


def exists(pattern: str) -> Moment:
    """The moment at which a file exists."""
    return lambda command: any(command.output.parent.glob(pattern))


MOMENTS = {
    "while the package is imported": (SIMULATE, imports("vessel_hsmc_ros.core.exceptions")),
    "while NumPy is imported": (SIMULATE, imports("numpy.linalg")),
    "while the verb is imported": (SIMULATE, imports("vessel_hsmc_ros.cli.options")),
    "before the nodes are connected": (RUN, exists("runs/*/logs/*.log")),
    "during a run": (RUN, exists("runs/*/bag/bag_0.mcap")),
    "during a simulation": ([*SIMULATE, "--interpreted"], prints("simulating case2_tracking: ")),  # has little to write then
    "while the page of a simulation is made": ([*SIMULATE[:-1], "vessel_sim.duration=1"], exists("runs/*/run.json")),
    "during the reproduction of the paper": (["reproduce", "--output", "paper"], runs("spawn_main")),
    "while a report is made": (["report", "../bag"], imports("jinja2.environment")),
}


OFTEN = "while NumPy is imported", "during a run", "during a simulation", "while a report is made"


@pytest.mark.parametrize("name", rest_long(sorted(MOMENTS, key=lambda name: name not in OFTEN), len(OFTEN)))
def test_ctrl_c_ends_the_command_with_one_line_and_130(start: Start, tmp_path: Path, name: str) -> None:
    arguments, moment = MOMENTS[name]
    if "../bag" in arguments:
        bag_making.write_run(tmp_path / "bag", 20)
    command = start("vessel-hsmc", *arguments, environment={"PYTHONPROFILEIMPORTTIME": "1"})
    command.until(lambda: moment(command))
    os.killpg(command.popen.pid, signal.SIGINT)
    assert command.wait() == 130
    lines = [line for line in command.text.splitlines() if line and not line.startswith("import time:")]
    assert "Traceback" not in command.text
    assert "Exception ignored" not in command.text
    (line,) = [line for line in lines if "interrupted" in line]
    assert line == "interrupted"


@pytest.mark.long
def test_a_second_ctrl_c_ends_the_command_at_once(start: Start) -> None:
    command = start("vessel-hsmc", *SIMULATE, "--interpreted")
    command.until(lambda: "simulating case2_tracking: " in command.text)
    while command.popen.poll() is None:
        command.popen.send_signal(signal.SIGINT)
    assert command.popen.returncode == 130
    assert "Traceback" not in command.text


def test_the_outcome_of_a_run_is_kept_if_its_page_is_interrupted(start: Start) -> None:
    command = start("vessel-hsmc", "run", "case2_tracking", "--set", "vessel_sim.duration=1")
    runs_folder = command.output.parent / "runs"
    command.until(lambda: (folder := run_folder(runs_folder)) and (folder / "run.json").exists())
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == 130
    folder = run_folder(runs_folder)
    assert folder
    assert json.loads((folder / "run.json").read_text(encoding="utf-8"))["exit_code"] == 0
    assert not (folder / "figures" / "track.png").exists()


def test_a_node_started_by_hand_ends_without_a_traceback_while_it_imports(start: Start) -> None:
    executable("controller_node")
    command = start(BIN / "controller_node", environment={"PYTHONPROFILEIMPORTTIME": "1"})
    command.until(lambda: imports("numpy.linalg")(command))
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == 0
    assert "Traceback" not in command.text


def test_what_the_tests_start_receives_ctrl_c_where_a_script_started_them_with_it_ignored() -> None:
    program = "import conftest, os; os.execvp('grep', ['grep', 'SigIgn', '/proc/self/status'])"
    script = ["sh", "-c", 'trap \'\' INT; exec "$0" -c "$1"', sys.executable, program]
    done = subprocess.run(script, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True)
    ignored = int(done.stdout.split()[1], 16)
    assert not ignored & 1 << signal.SIGINT - 1
