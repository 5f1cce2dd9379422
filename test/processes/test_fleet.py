"""`vessel-hsmc run --vessels`: vessels that take their steps together are bit-identical with single runs of their own."""

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from harness import Command, children, exit_code, process_name, run_folder

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.report.page import Options, make
from vessel_hsmc_ros.simulation import compilation
from vessel_hsmc_ros.simulation.offline import simulate

Start = Callable[..., Command]

COMMAND_LIMIT = 240.0
"""Time limit of a command, s."""

STEPS = 60
NOISY = ["--set", "controller.law=guided", "--set", "vessel_sim.sensors.position_noise=0.1"]
SHORT = ["case2_tracking", *NOISY, "--set", f"vessel_sim.duration={STEPS / 100}"]
ARRAYS = ("time", "state", "measured", "reference", "wrench", "disturbance")


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of two vessels in lockstep."""
    from harness import executable

    folder = tmp_path_factory.mktemp("fleet")
    command = Command([executable("vessel-hsmc"), "run", *SHORT, "--vessels", "2", "--namespace", "tug"], folder, {})
    assert command.wait(COMMAND_LIMIT) == 0, command.text
    found = run_folder(folder / "runs")
    assert found is not None
    return found


def test_each_vessel_is_bit_identical_with_a_single_run_from_its_start(two: Path) -> None:
    compilation.disable()  # a run this short takes less time than the compilation of its law
    bag = open_bag(two)
    assert sorted(bag.namespaces) == ["/tug_1/", "/tug_2/"]
    for number, namespace in enumerate(sorted(bag.namespaces)):
        scenario = bag.scenario(namespace=namespace)
        assert scenario.vessel_sim.initial_pose[1] == 1.0 + 50.0 * number
        recorded, alone = bag.run(namespace=namespace), simulate(scenario)
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(recorded, name), getattr(alone, name), err_msg=f"{namespace}{name}")


def test_vessels_have_noise_of_their_own(two: Path) -> None:
    bag = open_bag(two)
    noise = [(run.measured - run.state)[:, 0] for run in (bag.run(namespace=name) for name in bag.namespaces)]
    assert not np.array_equal(noise[0], noise[1])


def test_one_clock_ticks_once_for_every_step(two: Path) -> None:
    stamps = [t for _, t, _ in open_bag(two).messages("/clock")]
    ticks = open_bag(two)["/clock"]["clock.nanosec"]
    np.testing.assert_array_equal(ticks, np.arange(STEPS + 1) * 10_000_000)
    assert len(stamps) == STEPS + 1


def test_no_message_is_lost_and_frames_are_those_of_the_vessel(two: Path) -> None:
    bag = open_bag(two)
    assert bag.recording["messages_dropped"] == "0"
    for namespace in bag.namespaces:
        assert bag.topics[f"{namespace}odom"].count == STEPS + 1
        _, _, message = next(bag.messages(f"{namespace}odom"))
        assert message.header.frame_id == f"{namespace.strip('/')}/odom"


def test_summary_and_page_show_every_vessel(two: Path) -> None:
    summary = json.loads((two / "run.json").read_text())
    assert sorted(summary["vessels"]) == ["tug_1", "tug_2"]
    assert all(each["metrics"]["position_error_rms"] > 0.0 for each in summary["vessels"].values())
    assert all(each["messages_dropped"] == 0 for each in summary["vessels"].values())
    page = (two / "report.html").read_text()
    assert all(f'"label":"tug_{number}"' in page for number in (1, 2))
    assert (two / "figures" / "track.png").is_file()


def test_the_bag_of_a_fleet_is_reported_by_itself(two: Path, tmp_path: Path) -> None:
    assert sorted(r.name for r in make([two], Options(page=tmp_path / "all.html")).records) == ["tug_1", "tug_2"]
    (one,) = make([two], Options(page=tmp_path / "one.html", namespace="tug_2")).records
    assert one.scenario is not None
    assert one.scenario.vessel_sim.initial_pose[1] == 51.0


@pytest.mark.alone
def test_a_killed_node_of_a_vessel_ends_the_run_and_is_named_with_it(start: Start) -> None:
    command = start("vessel-hsmc", "run", "case2_tracking", "--vessels", "2", "--set", "vessel_sim.duration=400")

    def controller() -> int | None:
        """The controller of the second vessel, once the first odometry has been recorded."""
        found = [pid for pid in children(command.popen.pid) if "vessel_2/controller".startswith(process_name(pid) or "-")]
        bags = list(command.output.parent.glob("runs/*/bag/*.mcap"))
        running = bags and bags[0].stat().st_size > 100_000
        return found[0] if found and running else None

    os.kill(command.until(controller, COMMAND_LIMIT), signal.SIGKILL)  # type: ignore[arg-type]
    assert command.wait(COMMAND_LIMIT) == 1
    assert "error: vessel_2/controller was killed by SIGKILL" in command.text
    assert not children(command.popen.pid)


@pytest.mark.alone
def test_vessels_in_real_time_keep_to_the_wall_clock(start: Start) -> None:
    changes = ["--set", "controller.law=guided", "--set", "vessel_sim.duration=1"]
    command = start("vessel-hsmc", "run", "case2_tracking", "--vessels", "2", "--real-time", "--no-page", *changes)
    assert command.wait(COMMAND_LIMIT) == 0, command.text
    folder = run_folder(command.output.parent / "runs")
    assert folder is not None
    summary = json.loads((folder / "run.json").read_text())
    assert summary["mode"] == "real time"
    assert [each["steps"] for each in summary["vessels"].values()] == [100, 100]


def test_vessels_whose_namespace_is_in_use_are_refused(start: Start) -> None:
    from vessel_hsmc_ros.nodes.runs.supervisor import exclusive

    with exclusive("vessel_2"):
        command = start("vessel-hsmc", "run", "case2_tracking", "--vessels", "2")
        assert command.wait(COMMAND_LIMIT) == 1
    assert "another run uses ROS domain" in command.text
    assert "namespace /vessel_2" in command.text
    assert run_folder(command.output.parent / "runs") is None


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--vessels", "0"], "is not in the range 1<=x<=100"),
        (["--vessels", "101"], "is not in the range 1<=x<=100"),
        (["--vessels", "2", "--live"], "--vessels cannot be given with --campaign, --faults, --live"),
        (["--vessels", "2", "--namespace", "no good"], "namespace must be"),
    ],
)
def test_wrong_use_exits_with_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], options: list[str], reason: str
) -> None:
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", "run", "case2_tracking", *options])
    assert exit_code() == 2
    assert reason in " ".join(capsys.readouterr().err.replace("│", " ").split())
