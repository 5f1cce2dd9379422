"""The packets of ArduPilot's JSON interface, by known answers."""

import json
import math
import struct

import pytest

from vessel_hsmc_ros.boats.plants import Outputs, read_outputs, write_state
from vessel_hsmc_ros.core.kinematics import Motion


@pytest.mark.parametrize(("magic", "count"), [(18458, 16), (29569, 32)])
def test_outputs_are_read(magic: int, count: int) -> None:
    pulses = tuple(range(1000, 1000 + count))
    packet = struct.pack(f"<HHI{count}H", magic, 400, 70000, *pulses)
    assert read_outputs(packet) == Outputs(400, 70000, pulses)


@pytest.mark.parametrize("packet", [b"", b"\x1a", b"hello", struct.pack("<HHI15H", 18458, 1, 1, *[0] * 15), bytes(40)])
def test_other_packets_are_none(packet: bytes) -> None:
    assert read_outputs(packet) is None


def test_a_ship_heading_west_of_north_that_turns_and_slips() -> None:
    line = write_state(12.5, Motion(3.0, 40.0, 0.5 * math.pi + 0.25, 2.0, 0.5, 0.1), (0.3, -0.2, 0.05))
    assert (line[:2], line[-2:]) == (b"\n{", b"}\n"), "on a line of its own"
    for vector in (b"gyro", b"accel_body", b"position", b"attitude", b"velocity"):
        assert b'"%s":[' % vector in line, "ArduPilot finds a vector only two characters after its name"
    state = json.loads(line)
    assert state["timestamp"] == 12.5
    assert state["position"] == [40.0, 3.0, 0.0]
    assert state["attitude"] == pytest.approx([0.0, 0.0, -0.25])
    assert state["imu"]["gyro"] == [0.0, 0.0, -0.1]
    ahead, aside = (math.cos(0.25), -math.sin(0.25)), (-math.sin(0.25), -math.cos(0.25))  # north, east
    velocity = [2.0 * a + 0.5 * b for a, b in zip(ahead, aside, strict=True)]
    assert state["velocity"] == pytest.approx([*velocity, 0.0])
    # du - v·r ahead, -(dv + u·r) to starboard, and gravity upwards, down being positive
    assert state["imu"]["accel_body"] == pytest.approx([0.3 - 0.05, -(-0.2 + 0.2), -9.80665])


def test_a_ship_on_a_steady_circle_shows_the_centripetal_acceleration() -> None:
    state = json.loads(write_state(0.0, Motion(0.0, 0.0, 0.0, 3.0, 0.0, 0.2), (0.0, 0.0, 0.0)))
    assert state["imu"]["accel_body"][:2] == pytest.approx([0.0, -0.6]), "to port"
