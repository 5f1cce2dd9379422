"""The packets between ArduPilot's simulated autopilot (SITL) and foreign physics, its JSON interface.

The autopilot sends its outputs in binary: a magic number, the rate that it would like, Hz, a count of frames, and 16 or 32 pulse
widths, µs. The physics answers with a line of JSON between line breaks: time, rates and specific force of the body, and position,
attitude and velocity from north, east and down.
"""

import json
import math
import struct
from typing import NamedTuple

from vessel_hsmc_ros.core.kinematics import Motion, wrap

PACKETS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""The forms of a packet by their magic numbers."""

GRAVITY = 9.80665

SEPARATORS = ",", ":"
"""The autopilot looks for the values next to the colons: after a blank it finds no vector."""


class Outputs(NamedTuple):
    """The outputs of a frame: the rate that the autopilot would like, Hz, the number of the frame, and pulse widths, µs."""

    rate: int
    number: int
    pulses: tuple[int, ...]


def read_outputs(packet: bytes) -> Outputs | None:
    """The outputs of a packet; None if it is not one of the autopilot."""
    form = PACKETS.get(int.from_bytes(packet[:2], "little"))
    if form is None or len(packet) != form.size:
        return None
    _, rate, number, *pulses = form.unpack(packet)
    return Outputs(rate, number, tuple(pulses))


def write_state(time: float, motion: Motion, acceleration: tuple[float, float, float]) -> bytes:
    """The answer to a frame.

    The accelerometer of a level ship shows the acceleration of the rotating body, (du - v·r, dv + u·r), and gravity.

    Args:
        time: Time of the physics, s.
        motion: The ship's motion.
        acceleration: du, dv, dr, the derivatives of the velocities in the body frame.
    """
    du, dv, _ = acceleration
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    east, north = motion.u * c - motion.v * s, motion.u * s + motion.v * c
    content = {
        "timestamp": time,
        "imu": {
            "gyro": [0.0, 0.0, -motion.r],
            "accel_body": [du - motion.v * motion.r, -(dv + motion.u * motion.r), -GRAVITY],
        },
        "position": [motion.y, motion.x, 0.0],
        "attitude": [0.0, 0.0, wrap(0.5 * math.pi - motion.psi)],
        "velocity": [north, east, 0.0],
    }
    return f"\n{json.dumps(content, separators=SEPARATORS)}\n".encode()
