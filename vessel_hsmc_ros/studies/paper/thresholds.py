"""The thresholds of the claims, and the checks that several of them share.

The paper gives no numbers for its claims. The thresholds are ours and generous: the ship is some 30 m long and starts 17 m off
its reference. They are the same for both forms of the law.
"""

from vessel_hsmc_ros.studies.paper.checks import Check

# 2·pi/0.05 rad/s, rounded.
CYCLE = 126.0  # period of case 1's reference, s
CLOSE = 1.0  # a ship tracks its reference if the position error, m, and the heading error, degrees, stay below this
CONVERGED, CONVERGED_DEG = 0.1, 0.1  # an error below this has converged to zero, m and degrees
FORCE_LIMIT, MOMENT_LIMIT = 2e5, 3e6
"""What the actuators of such a ship could deliver, N and N·m: twice the force and three times the moment that case 2 needs."""


def close(run: str, label: str) -> Check:
    """The position error of a run stays below CLOSE."""
    return Check(f"{label}, position error", run, "position_error_late", below=CLOSE, unit=" m")


def heading_close(run: str, label: str) -> Check:
    """The heading error of a run stays below CLOSE."""
    return Check(f"{label}, heading error", run, "heading_error_late_deg", below=CLOSE, unit="°")


TRAJECTORIES = (close("circle", "circle"), close("straight", "straight line"), close("slalom_long", "slalom"))
"""All trajectories of the paper are tracked."""
