"""The law of the standard manoeuvres: approach, execute, and the programme of each manoeuvre."""

import math
from typing import Any

import pytest

from vessel_hsmc_ros.control.laws import LAWS, make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.studies.comparison import default_laws

PERIOD = 0.1
LIMITS = {"surge_force_limit": 100.0, "yaw_moment_limit": 70.0, "yaw_inertia": 10.0}
STILL = Acceleration(0.0, 0.0, 0.0)
REFERENCE = Motion(5.0, 5.0, 1.0, 1.0, 0.0, 0.0)


def commands(headings_deg: list[float], speed: float = 1.0, **settings: Any) -> list[tuple[float, float]]:
    """The commands of a manoeuvre without approach to a ship with these headings."""
    law = make_controller("manoeuvre", PERIOD, **{**LIMITS, "approach_time": 0.0, **settings})
    return [law.step(Motion(0.0, 0.0, math.radians(angle), speed, 0.0, 0.0), REFERENCE, STILL)[0] for angle in headings_deg]


def moments(headings_deg: list[float], **settings: Any) -> list[float]:
    return [round(moment, 9) for _, moment in commands(headings_deg, **settings)]


def test_the_law_follows_no_reference_and_is_left_out_of_comparisons() -> None:
    assert not LAWS["manoeuvre"].controller.tracks
    assert "manoeuvre" not in default_laws()


def test_the_approach_keeps_the_initial_heading_at_its_share_of_the_force() -> None:
    found = commands([20.0, 20.0, 21.0, 19.0], approach_time=10.0, approach_share=0.8)
    assert [force for force, _ in found] == [80.0] * 4
    assert found[1][1] == 0.0
    assert found[2][1] < 0.0 < found[3][1]


@pytest.mark.parametrize(("side", "sign"), [("port", 1.0), ("starboard", -1.0)])
def test_a_turning_circle_begins_after_the_approach_to_its_side(side: str, sign: float) -> None:
    found = commands([0.0] * 5, approach_time=0.3, side=side)
    assert [moment for _, moment in found] == [0.0, 0.0, 0.0, 70.0 * sign, 70.0 * sign]


def test_the_rudder_angle_is_a_share_of_35_degrees_of_the_yaw_moment() -> None:
    assert moments([0.0], rudder_deg=10.0, side="port") == [20.0]


def test_a_zigzag_reverses_where_the_heading_has_changed_by_the_switch_heading() -> None:
    headings = [170.0, 175.0, -179.0, -170.0, 178.0, 161.0, 159.0, 158.0]
    found = moments(headings, kind="zigzag", side="port", rudder_deg=35.0, switch_heading_deg=10.0)
    assert found == [70.0, 70.0, -70.0, -70.0, -70.0, -70.0, 70.0, 70.0]


def test_a_spiral_goes_from_one_side_to_the_other_and_back_and_stays_there() -> None:
    found = moments([0.0] * 7, kind="spiral", side="starboard", steps=3, hold_time=PERIOD)
    assert found == [-70.0, 0.0, 70.0, 0.0, -70.0, -70.0, -70.0]


def test_a_crash_stop_goes_full_astern_until_the_ship_has_stopped_and_not_again() -> None:
    law = make_controller("manoeuvre", PERIOD, **LIMITS, kind="crash_stop", approach_time=PERIOD, approach_share=0.5)
    speeds = [1.0, 1.0, 0.5, 0.1, -0.01, 0.02]
    found = [law.step(Motion(0.0, 0.0, 0.3, speed, 0.0, 0.0), REFERENCE, STILL)[0] for speed in speeds]
    assert found == [(50.0, 0.0), (-100.0, 0.0), (-100.0, 0.0), (-100.0, 0.0), (0.0, 0.0), (0.0, 0.0)]


def test_speed_runs_raise_the_force_in_equal_steps() -> None:
    found = commands([0.0] * 6, kind="speed_run", steps=4, hold_time=PERIOD)
    assert [force for force, _ in found] == [25.0, 50.0, 75.0, 100.0, 100.0, 100.0]


def test_a_bollard_pull_takes_the_whole_force() -> None:
    assert commands([0.0], kind="bollard_pull") == [(100.0, 0.0)]


def test_the_terms_are_the_change_of_heading_and_the_heading_of_the_next_reversal() -> None:
    law = make_controller("manoeuvre", PERIOD, **LIMITS, kind="zigzag", approach_time=0.0, side="port", switch_heading_deg=20.0)
    for angle in (175.0, -179.0):
        _, terms = law.step(Motion(0.0, 0.0, math.radians(angle), 1.0, 0.0, 0.0), REFERENCE, STILL)
    assert math.degrees(terms.heading_error) == pytest.approx(6.0)
    assert math.degrees(terms.commanded_heading) == pytest.approx(-165.0)


def test_a_reset_returns_to_the_start_of_the_approach() -> None:
    law = make_controller("manoeuvre", PERIOD, **LIMITS, approach_time=PERIOD)
    motion = Motion(0.0, 0.0, 0.2, 1.0, 0.0, 0.0)
    first = [law.step(motion, REFERENCE, STILL)[0] for _ in range(3)]
    law.reset()
    assert [law.step(motion, REFERENCE, STILL)[0] for _ in range(3)] == first


def test_the_approach_is_critically_damped_within_the_whole_moment_although_the_rudder_takes_less() -> None:
    """tau_2 = -(N_max/4)·dpsi - sqrt(m33·N_max)·r, up to N_max."""
    law = make_controller("manoeuvre", PERIOD, **LIMITS, surge_inertia=3.0, approach_time=9.0, rudder_deg=3.5)
    cases = [(0.0, 0.0), (0.2, 0.0), (-0.1, 0.3), (0.05, -0.7), (-0.4, -3.0), (0.3, 4.0)]
    found = [law.step(Motion(1.0, 2.0, 3.1 + turn, 1.0, 0.0, rate), REFERENCE, STILL)[0][1] for turn, rate in cases]
    demands = [-70.0 / 4.0 * turn - math.sqrt(10.0 * 70.0) * rate for turn, rate in cases]
    assert found == pytest.approx([min(max(demand, -70.0), 70.0) for demand in demands])
    assert max(map(abs, demands)) > 70.0


@pytest.mark.parametrize("kind", ["spiral", "speed_run"])
def test_a_time_that_is_hardly_less_than_whole_steps_takes_these_steps(kind: str) -> None:
    """0.3 s and 0.7 s are no whole numbers of steps of 0.1 s but for rounding."""
    for hold, steps in ((0.3, 3), (0.7, 7), (0.29, 3)):
        found = commands([0.0] * 40, kind=kind, steps=3, hold_time=hold)
        changes = [k for k in range(1, 40) if found[k] != found[k - 1]]
        assert changes[:2] == [steps, 2 * steps]


def test_a_zigzag_to_starboard_is_the_mirror_image_of_one_to_port() -> None:
    headings = [0.0, 4.0, 9.0, 11.0, 12.0, 3.0, -8.0, -10.5, -9.0, 0.0, 10.0, 10.5]
    settings: Any = {"kind": "zigzag", "rudder_deg": 20.0, "switch_heading_deg": 10.0}
    port = moments(headings, side="port", **settings)
    assert moments([-angle for angle in headings], side="starboard", **settings) == [-moment for moment in port]
    assert [round(moment / 40.0) for moment in port] == [1, 1, 1, -1, -1, -1, -1, 1, 1, 1, -1, -1]
