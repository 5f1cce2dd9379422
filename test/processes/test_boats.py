"""A boat whose stack is plain rclpy, steered through the interface of a stack, started by the commands of docs/boats.md."""

import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import definitions
import pytest
from durations import rest_long
from harness import Command, exit_code
from sockets import free_port

from vessel_hsmc_ros.boats.parameters import commands, interfaces

BOAT = Path(__file__).parents[1] / "support" / "foreign_boat.py"
SHIP = ["--length", "5", "--mass", "520", "--surge-force-limit", "300", "--yaw-moment-limit", "250", "--speed", "2"]
REPORT = re.compile(r"at (\S+) (\S+), (\S+) m from the reference")
MOUNTED = "antenna: [1.0, 0.0], datum: [59.9, 10.7]"
"""Place of the antenna of the foreign boat, and its origin."""

STACKS = {
    "ardupilot_dds": "--state pose_twist --frame base_link --twist parent --best-effort --rate 28 32 --command cmd_vel",
    "mavlink": "--state mavlink --command mavlink",
    "px4": "--state px4 --command px4",
    "otter": "--state otter --rate 9 11 --command otter",
}

HOLD = 4
MAVLINK = "/**/mavlink:\n  ros__parameters: {"


@pytest.fixture
def vessel_hsmc(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Carries out a command in this process, as each of its own would import everything again; returns its exit code."""

    def carried_out(*arguments: object) -> int:
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *map(str, arguments)])
        return exit_code()

    return carried_out


def takes_over(port: int) -> str:
    """Select another mode from a ground station of its own; returns what the node then logs."""
    from pymavlink import mavutil

    station = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=250)
    station.mav.set_mode_send(1, 1, HOLD)
    station.close()
    return "mode HOLD, commands need MANUAL"


@pytest.mark.parametrize("stack", rest_long(["otter", "mavlink", "ardupilot_dds", "px4"]))
def test_a_foreign_boat_follows_a_path_and_stops(
    start: Callable[..., Command], vessel_hsmc: Callable[..., int], tmp_path: Path, stack: str
) -> None:
    if stack == "mavlink":
        pytest.importorskip("pymavlink", exc_type=ImportError)
    messages = definitions.environment("px4_msgs") if stack == "px4" else {}
    if messages is None:
        pytest.skip("px4_msgs is not installed, and nothing is there to compile it")
    assert vessel_hsmc("init", tmp_path / "boat", *SHIP, "--interface", stack, "--no-check") == 0
    (tmp_path / "legs.csv").write_text("x,y\n0,0\n20,0\n")
    connection = tmp_path / f"boat_{stack}.yaml"  # with the place of the antenna, as the page has a person write it
    text = connection.read_text().replace("heading: imu_euler", f"heading: imu_euler, {MOUNTED}")
    port, station = free_port(), free_port()
    connection.write_text(text.replace(MAVLINK, f"{MAVLINK}connection: 'udpin:127.0.0.1:{port}', "))
    addresses = [f"udpout:127.0.0.1:{port}", f"udpin:127.0.0.1:{station}"] if stack == "mavlink" else []
    remaps = [f"{own}:={other}" for topics in interfaces()[stack].nodes.values() for own, other in topics.items()]
    nodes: dict[str, Command] = {}
    for line in commands(interfaces()[stack], str(tmp_path / "boat")):
        program, *arguments = shlex.split(line)
        nodes[program] = start(program, *arguments, environment=messages)
    address = ["--address", *addresses] if addresses else []
    boat = start(
        Path(sys.executable), BOAT, *STACKS[stack].split(), *address, "--ros-args", *(w for r in remaps for w in ("-r", r))
    )
    boat.until(lambda: REPORT.search(boat.text))

    def latest() -> tuple[float, ...]:
        return tuple(map(float, REPORT.findall(boat.text)[-1]))

    assert vessel_hsmc("path", tmp_path / "legs.csv", "--detach") == 0
    boat.until(lambda: vessel_hsmc("call", "enable") == 0)
    boat.until(lambda: latest()[0] > 1.5)
    assert abs(latest()[1]) < 0.5, "off the leg, which is along x"

    if stack == "mavlink":
        nodes["mavlink_node"].until(lambda: takes_over(station) in nodes["mavlink_node"].text)
        return

    def advance() -> float:
        """The way of the last second, m."""
        before, now = (float(found[0]) for found in REPORT.findall(boat.text)[-2:])
        return now - before

    moving = advance()
    assert vessel_hsmc("call", "stop") == 0
    boat.until(lambda: advance() < 0.5 * moving)  # without thrust it slows down
