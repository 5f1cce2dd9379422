"""`vessel-hsmc check BAG`: bags of other recorders, with the topics of a stack."""

import json
import math
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_making import STORE, message, serialized, topic
from click.testing import CliRunner, Result

from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.cli import boat
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.preflight import live as connection_check
from vessel_hsmc_ros.preflight.connection import Connection

ODOMETRY, WRENCH = "nav_msgs/msg/Odometry", "geometry_msgs/msg/WrenchStamped"
NAME = "/mavros/local_position/odom"


def made(kind: str, **fields: Any) -> Any:
    return STORE.types[f"geometry_msgs/msg/{kind}"](**fields)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return made("Vector3", x=x, y=y, z=z)


def write_circle(directory: Path, factor: float = 1.0, moment: float = 40.0) -> None:
    """A bag of a boat that turns at 1.5 m/s, under a moment that comes and goes; its speeds are multiplied by a factor."""
    writer, rng = BagWriter(directory), np.random.default_rng(1)
    odometry, wrench = topic(NAME, ODOMETRY), topic("/cmd_wrench", WRENCH)
    writer.add_topic(odometry)
    writer.add_topic(wrench)
    x = y = psi = r = 0.0
    for k in range(600):
        stamp, on = 10**12 + k * 50_000_000, moment * (k // 80 % 2)
        r += 0.05 * (abs(on) / 200.0 - 0.3 * r)
        psi, x, y = psi + 0.05 * r, x + 0.075 * math.cos(psi), y + 0.075 * math.sin(psi)
        turn = made("Quaternion", x=0.0, y=0.0, z=math.sin(0.5 * psi), w=math.cos(0.5 * psi))
        pose = made("Pose", position=made("Point", x=x, y=y, z=0.0), orientation=turn)
        sent = message(
            ODOMETRY,
            stamp,
            rng,
            header=STORE.types["std_msgs/msg/Header"](stamp=clock(stamp), frame_id="map"),
            child_frame_id="base_link",
            pose=made("PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
            twist=made(
                "TwistWithCovariance",
                twist=made("Twist", linear=vector(factor * 1.5), angular=vector(z=r)),
                covariance=np.zeros(36),
            ),
        )
        writer.write(odometry, serialized(sent, ODOMETRY), stamp + 10_000_000, stamp)
        header = STORE.types["std_msgs/msg/Header"](stamp=clock(stamp), frame_id="base_link")
        wrench_sent = made("Wrench", force=vector(), torque=vector(z=on))
        command = message(WRENCH, stamp, rng, header=header, wrench=wrench_sent)
        writer.write(wrench, serialized(command, WRENCH), stamp, stamp)
    writer.close()


def clock(stamp: int) -> Any:
    return STORE.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)


def check(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["check", *map(str, arguments)], standalone_mode=False)


@pytest.mark.long
def test_a_bag_of_another_recorder_is_checked_under_the_names_of_its_stack(tmp_path: Path) -> None:
    write_circle(tmp_path / "bag")
    result = check(tmp_path / "bag", "--interface", "mavros")
    assert result.exception is None, result.output
    assert f"{NAME}: nav_msgs/msg/Odometry, 20 Hz" in result.output
    assert "positive yaw moment drives to port" in result.output


def test_mistakes_in_a_bag_are_an_error_and_named_for_programs_too(tmp_path: Path) -> None:
    write_circle(tmp_path / "bag", factor=1.0 / 0.5144, moment=-40.0)
    result = check(tmp_path / "bag", "--json")
    assert isinstance(result.exception, RunError)
    wrong = {each["about"]: each["text"] for each in json.loads(result.stdout) if each["level"] == "wrong"}
    assert "in knots?" in wrong.pop("velocities")
    assert "positive yaw moment drives to starboard" in wrong.pop("sign of moment")
    assert not wrong


@pytest.mark.parametrize("pulse", ["30", "30,0", "nan,20", "30,20,10"])
def test_a_pulse_is_two_numbers_other_than_zero(pulse: str) -> None:
    result = check("--pulse", pulse, "--yes")
    assert isinstance(result.exception, ParameterError)
    assert "must be a force in N and a moment in N·m, both not 0" in str(result.exception)


def test_a_scenario_in_the_place_of_a_bag_is_refused_with_what_to_give(tmp_path: Path) -> None:
    result = check(tmp_path / "boat.yaml")
    assert isinstance(result.exception, ParameterError)
    assert "BAG must be a recording" in str(result.exception)


def test_a_bag_takes_no_pulse(tmp_path: Path) -> None:
    result = check(tmp_path, "--pulse", "30,20")
    assert isinstance(result.exception, ParameterError)


@pytest.mark.parametrize("answer", ["y", "n"])
def test_a_pulse_of_force_and_moment_is_commanded_after_a_confirmation(monkeypatch: pytest.MonkeyPatch, answer: str) -> None:
    done: list[Any] = []

    class Observed:
        """Stands for the connection with running nodes."""

        units = ("N", "N·m")

        def __init__(self, *_: Any) -> None:
            pass

        def listen(self, limit: float) -> None:
            done.append(limit)

        def pulse(self, force: float, moment: float) -> None:
            done.append((force, moment))

        def connection(self) -> Connection:
            return Connection(())

    monkeypatch.setattr(boat, "running_vessel", nullcontext)
    monkeypatch.setattr(connection_check, "LiveConnection", Observed)
    result = CliRunner().invoke(cli, ["check", "--seconds", "3", "--pulse", "30,-20"], input=answer)
    assert "30 N for 2 s, then -20 N·m for 2 s" in result.output
    assert done == ([3.0, (30.0, -20.0)] if answer == "y" else [])
