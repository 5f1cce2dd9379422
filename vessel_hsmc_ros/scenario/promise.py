"""A row of the table of promises, and the phrases and files of tests that rows share."""

from typing import NamedTuple

from vessel_hsmc_ros.safety.reasons import Reason


class Promise(NamedTuple):
    """One row.

    Attributes:
        signal: What happens.
        timeout: After which time or above which bound it counts.
        clock: The clock of that time.
        action: What is commanded.
        recovery: How the law commands again.
        reasons: Codes in `~/state` and in the diagnostics.
        tests: Tests that hold the row, `path::name` below test/.
    """

    signal: str
    timeout: str
    clock: str
    action: str
    recovery: str
    reasons: tuple[Reason, ...]
    tests: tuple[str, ...]


SAFE = "safe action, {controller.safety.action}"
ITSELF = "by itself after {controller.safety.fresh_samples} good control periods, at the bounded rate"
KEPT = "none: the last good sample counts until it is overdue"
NEXT = "with the next good sample"

ROS_TIME = "ROS time, by the stamp"
PERIODS = "control periods"

FRESH, STATES, PLAUSIBLE = (f"safety/test_{name}.py" for name in ("freshness", "supervision", "plausibility"))
CLOCK, CONTROLLER, PLANT, THRUSTERS, WATCHDOG = (
    f"nodes/test_{name}.py"
    for name in ("controller_clock", "controller_safety", "vessel_sim_real_time", "thruster_allocation_node", "watchdog_node")
)
TAKEN = f"{FRESH}::test_a_sample_is_taken_or_refused_with_its_reason"
