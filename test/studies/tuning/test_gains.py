"""The gains of a tuning: names and ranges from the command line."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.studies.tuning.plan import Gain, parse_gains, with_gains

GAIN = "controller.guided.position_gain"


@pytest.fixture(scope="module")
def present() -> Scenario:
    return load_scenario("case2_tracking", {"controller.law": "guided", "controller.guided.approach_speed": 2.0})


def test_a_range_is_linear_or_logarithmic(present: Scenario) -> None:
    linear, logarithmic = parse_gains([f"{GAIN}=0.1:0.5", "controller.guided.integral_gain=1e-3:1e-1:log"], "guided", present)
    assert linear == Gain(GAIN, 0.1, 0.5, False, False, "1/T")
    assert logarithmic[1:4] == (1e-3, 1e-1, True)


def test_without_a_range_it_is_a_decade_around_the_present_value_inside_the_declared_one(present: Scenario) -> None:
    around, clipped = parse_gains(["controller.guided.approach_speed", "controller.guided.approach_angle"], "guided", present)
    assert around.high / around.low == pytest.approx(10.0)
    assert around.low * around.high == pytest.approx(2.0**2)
    assert clipped.high == math.pi / 2


@pytest.mark.long
def test_without_a_range_a_whole_gain_has_the_decade_around_it_rounded_outwards_and_is_one_at_least() -> None:
    scenario = load_scenario("case2_tracking", {"controller.law": "nmpc"})
    steps, iterations = parse_gains(["controller.nmpc.steps", "controller.nmpc.iterations"], "nmpc", scenario)
    assert (scenario.controller.nmpc.steps, scenario.controller.nmpc.iterations) == (8, 1)
    assert steps[1:5] == (2, 26, True, True)
    assert iterations[1:5] == (1, 4, True, True)


def test_no_value_of_a_range_lies_beyond_it_by_rounding() -> None:
    random = np.random.default_rng(1)
    for low, high in np.sort(random.uniform(0.01, 50.0, (500, 2))).tolist():
        for logarithmic in (False, True):
            gain = Gain(GAIN, low, high, logarithmic)
            assert all(low <= gain.at(share) <= high for share in (0.0, 1.0, np.nextafter(1.0, 0.0)))
            assert gain.at(0.0) == pytest.approx(low)
            assert gain.at(1.0) == pytest.approx(high)


def test_an_asterisk_stands_for_all_gains_that_match(present: Scenario) -> None:
    gains = parse_gains(["controller.los_pid.yaw_*"], "los_pid", present)
    assert [gain.name for gain in gains] == ["yaw_bandwidth", "yaw_damping", "yaw_integral_gain"]


def test_a_range_beside_an_asterisk_takes_precedence(present: Scenario) -> None:
    first, *_ = parse_gains(["controller.los_pid.yaw_bandwidth=0.1:0.2", "controller.los_pid.yaw_*"], "los_pid", present)
    assert (first.low, first.high) == (0.1, 0.2)


@pytest.mark.parametrize(
    ("text", "law", "message"),
    [
        ("controller.guided.position_gian", "guided", "is not a gain of guided: did you mean controller.guided.position_gain"),
        ("position_gain", "guided", "did you mean controller.guided.position_gain"),
        (GAIN, "los_pid", "must be one of los_pid, the law to tune"),
        (f"{GAIN}=0.1:2e4", "guided", r"position_gain must be a finite number from 0.0001 to 100.*got 20000.0"),
        (f"{GAIN}=2:1", "guided", "must have low below high"),
        (f"{GAIN}=1:1", "guided", "must have low below high"),
        (f"{GAIN}=1:x", "guided", "must be controller.law.name"),
        (f"{GAIN}=1", "guided", "must be controller.law.name"),
        (f"{GAIN}=1:2:lin", "guided", "must be controller.law.name"),
        ("controller.los_pid.integral_gain=0:1:log", "los_pid", "with log must have low above 0"),
        (f"{GAIN}=1:2:3:4", "guided", "must be controller.law.name"),
        (f"{GAIN}=1:2:log:log", "guided", "must be controller.law.name"),
        ("controller.hierarchical_printed.switching", "hierarchical_printed", "--gain must be a number"),
        ("controller.observer.wave_period", "guided", "needs a range"),
        ("controller.los_pid.x*", "los_pid", "--gain must match one of"),
    ],
)
def test_a_gain_that_cannot_be_tuned_is_named(present: Scenario, text: str, law: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_gains([text], law, present)


def test_a_gain_given_twice_is_refused(present: Scenario) -> None:
    with pytest.raises(ParameterError, match="must be given once for each gain"):
        parse_gains([f"{GAIN}=0.1:0.2", f"{GAIN}=0.1:0.3"], "guided", present)


def test_gains_change_the_controller_only(present: Scenario) -> None:
    changed = with_gains(present, {GAIN: 0.2})
    assert changed.controller.guided.position_gain == 0.2
    assert changed.controller.guided.approach_speed == 2.0
    assert changed.vessel_sim == present.vessel_sim
    assert changed.given == present.given | {GAIN}


def test_an_unstable_gain_is_an_error(present: Scenario) -> None:
    slow = load_scenario("case2_tracking", {"controller.law": "los_pid", "controller.rate_hz": 10.0})
    with pytest.raises(InstabilityError):
        with_gains(slow, {"controller.law": "hierarchical_printed"})
