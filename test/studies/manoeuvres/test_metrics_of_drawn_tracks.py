"""The metrics of manoeuvres from tracks that are drawn instead of sailed, whose every number is known and unlike the others."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from records import make_run

from vessel_hsmc_ros.control.laws.manoeuvre import ManoeuvreParameters
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED
from vessel_hsmc_ros.studies.manoeuvres import page, run
from vessel_hsmc_ros.studies.manoeuvres.run import Track, track_of

ANGLES = np.radians([0.0, 45.0, 90.0, 180.0, 270.0, 360.0, 400.0])


def drawn(**known: Any) -> Track:
    """A track of which only some columns are known."""
    count = len(next(iter(known.values())))
    return Track(**{name: np.asarray(known.get(name, np.zeros(count)), float) for name in Track._fields})


def settings(**values: Any) -> ManoeuvreParameters:
    return replace(ManoeuvreParameters(), **values)


def test_a_turn_is_measured_at_its_own_angles() -> None:
    track = drawn(
        time=[0.0, 3.0, 7.0, 12.0, 18.0, 25.0, 33.0],
        ahead=[0.0, 40.0, 55.0, 20.0, -30.0, 10.0, 45.0],
        aside=[0.0, 8.0, 21.0, 77.0, 60.0, 5.0, 9.0],
        turned=ANGLES,
        u=[5.0, 6.0, 4.0, 3.5, 3.2, 3.1, 3.0],
        v=[0.0, -0.1, -0.3, -0.5, -0.6, -0.7, -0.75],
        r=[0.0, 0.2, 0.4, 0.3, 0.2, 0.2, 0.25],
    )
    speed = math.hypot(3.0, 0.75)
    assert run.turning_circle(track, settings()) == pytest.approx(
        {
            "advance": 55.0,
            "transfer": 21.0,
            "tactical_diameter": 77.0,
            "steady_diameter": 2.0 * speed / 0.25,
            "time_90": 7.0,
            "time_180": 12.0,
            "time_360": 25.0,
            "steady_speed": speed,
            "speed_loss": 100.0 * (1.0 - speed / 5.0),
            "steady_yaw_rate": math.degrees(0.25),
            "drift_angle": math.degrees(math.atan2(0.75, 3.0)),
        }
    )


def test_a_zigzag_is_measured_from_each_execute() -> None:
    degrees = np.array([0.0, 5.0, 12.0, 16.0, 14.0, -4.0, -11.0, -20.0, -23.0, -9.0, 13.0, 15.0])
    track = drawn(
        time=[0.0, 1.0, 3.0, 4.5, 6.0, 8.0, 9.0, 11.5, 14.0, 17.0, 21.0, 22.0],
        ahead=[0.0, 3.0, 11.0, 14.0, 20.0, 26.0, 30.0, 37.0, 45.0, 52.0, 60.0, 66.0],
        turned=np.radians(degrees),
        command=[1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0],
    )
    assert run.zigzag(track, settings(kind="zigzag", switch_heading_deg=10.0)) == pytest.approx(
        {
            "first_overshoot": 4.0,
            "second_overshoot": 12.0,
            "first_yaw_check_time": 1.5,
            "second_yaw_check_time": 5.0,
            "initial_turning_distance": 3.0 + 5.0 / 7.0 * 8.0,
            "initial_turning_time": 1.0 + 5.0 / 7.0 * 2.0,
            "period": 18.0,
        }
    )


def test_a_spiral_has_its_loop_its_rest_and_its_largest_rate() -> None:
    """Five rudder angles from 20° to -20° and back, one second each; the way back lags the way out."""
    rates = np.radians([3.0, 2.0, 1.0, -1.0, -4.5, -3.0, -1.5, 0.5, 2.5])
    track = drawn(time=np.arange(1.0, 10.0), r=rates)
    given = settings(kind="spiral", steps=5, hold_time=1.0, rudder_deg=20.0)
    assert run.spiral_curve(track, given) == pytest.approx(
        np.column_stack([[20.0, 10.0, 0.0, -10.0, -20.0, -10.0, 0.0, 10.0, 20.0], np.degrees(rates)])
    )
    # Zero at -5° on the way out and at 7.5° on the way back.
    expected = {"loop_width": 12.5, "residual_yaw_rate": 1.5, "largest_yaw_rate": 4.5}
    assert run.spiral(track, given) == pytest.approx(expected)


def test_a_crash_stop_is_measured_where_the_ship_stops() -> None:
    track = drawn(
        time=[0.0, 2.0, 5.0, 9.0, 14.0],
        ahead=[0.0, 6.0, 10.0, 12.0, 5.0],
        aside=[0.0, -8.0, -11.0, -13.0, -20.0],
        u=[4.0, 3.0, 1.0, -1.0, -2.0],
    )
    reach = 10.0 + 5.0 + 0.5 * math.hypot(2.0, 2.0)
    expected = {"track_reach": reach, "head_reach": 11.0, "side_reach": 12.0, "stopping_time": 7.0}
    assert run.crash_stop(track, settings()) == pytest.approx(expected)


def test_speed_runs_and_bollard_pull_are_measured_at_their_ends() -> None:
    track = drawn(time=np.arange(1.0, 9.0), u=[0.5, 1.0, 1.5, 1.8, 2.1, 2.2, 2.6, 2.9], force=[0, 10, 20, 70, 90, 98, 99, 100])
    given = settings(kind="speed_run", steps=4, hold_time=2.0)
    assert run.speed_curve(track, given) == pytest.approx(np.array([[0.25, 1.0], [0.5, 1.8], [0.75, 2.2], [1.0, 2.9]]))
    assert run.speed_run(track, given) == pytest.approx({"top_speed": 2.9, "half_force_speed": 1.8})
    assert run.bollard_pull(track, settings()) == pytest.approx({"bollard_pull": 100.0, "force_rise_time": 5.0 + 5.0 / 8.0})


@pytest.mark.parametrize(("side", "sign"), [("port", 1.0), ("starboard", -1.0)])
def test_a_track_begins_at_the_execute_and_is_seen_from_the_side_of_the_first_turn(side: str, sign: float) -> None:
    time = np.arange(6.0) * 0.5
    course = 2.8
    heading = course + np.array([0.0, 0.0, 0.0, 0.2, 0.5, 0.9])
    ahead, left = np.array([0.0, 1.0, 2.0, 3.0, 4.5, 6.5]), np.array([0.0, 0.0, 0.0, 0.3, 1.1, 2.3])
    x = 7.0 + ahead * math.cos(course) - left * math.sin(course)
    y = -4.0 + ahead * math.sin(course) + left * math.cos(course)
    motion = np.arange(18.0).reshape(6, 3) + 1.0
    wrapped = np.arctan2(np.sin(heading), np.cos(heading))
    wrench = np.arange(18.0).reshape(6, 3) + 100.0
    commanded = np.arange(12.0).reshape(6, 2) + 200.0
    run = make_run(time, np.column_stack([x, y, wrapped, motion]), wrench=wrench, control={"commanded": commanded})
    controller = SimpleNamespace(manoeuvre=settings(approach_time=1.0, side=side), rate_hz=2.0)
    track = track_of(run, SimpleNamespace(controller=controller))  # type: ignore[arg-type]
    expected = {
        "time": time[2:] - 1.0,
        "ahead": ahead[2:] - 2.0,
        "aside": sign * left[2:],
        "turned": sign * (heading[2:] - course),
        "u": motion[2:, 0],
        "v": sign * motion[2:, 1],
        "r": sign * motion[2:, 2],
        "force": wrench[2:, 0],
        "moment": sign * wrench[2:, 2],
        "command": sign * commanded[2:, 1],
    }
    for name, values in expected.items():
        assert getattr(track, name) == pytest.approx(values, abs=1e-12), name


@pytest.mark.parametrize(("side", "sign"), [("port", 1.0), ("starboard", -1.0)])
def test_a_note_names_each_velocity_beyond_the_hull_data_with_its_own_value(side: str, sign: float) -> None:
    hull = SimpleNamespace(surge_speed_range=(-1.0, 4.0), sway_speed_range=(-0.5, 0.25), yaw_rate_range=(-0.125, 0.375))
    track = drawn(u=[3.0, 4.5, 2.0], v=sign * np.array([0.2, -0.75, 0.1]), r=sign * np.array([0.3, -0.25, 0.4]))
    scenario = SimpleNamespace(
        vessel_sim=SimpleNamespace(vessel=hull), controller=SimpleNamespace(manoeuvre=SimpleNamespace(side=side))
    )
    done: Any = SimpleNamespace(failure="", metrics={}, complete=True, scenario=scenario, track=track)
    assert list(page.notes(done)) == [
        "The surge speed reaches 4.5 m/s, outside the range of the hull data, -1 to 4 m/s.",
        "The sway speed reaches -0.75 m/s, outside the range of the hull data, -0.5 to 0.25 m/s.",
        "The yaw rate reaches -0.25 rad/s, outside the range of the hull data, -0.125 to 0.375 rad/s.",
    ]


def test_each_criterion_limits_its_own_metric() -> None:
    found = {(each.manoeuvre, each.metric): (each.limit, each.text) for each in page.criteria(150.0, 7.5)}
    assert found == {
        ("turning_circle", "advance"): (675.0, "4.5 L"),
        ("turning_circle", "tactical_diameter"): (750.0, "5 L"),
        ("zigzag_10", "initial_turning_distance"): (375.0, "2.5 L"),
        ("zigzag_10", "first_overshoot"): (15.0, "15° for L/V = 20 s"),
        ("zigzag_10", "second_overshoot"): (32.5, "32.5° for L/V = 20 s"),
        ("zigzag_20", "first_overshoot"): (25.0, "25°"),
        ("crash_stop", "track_reach"): (2250.0, "15 L"),
    }


def test_the_time_of_the_actuators_is_that_of_the_slower_input() -> None:
    def delay(**values: float) -> float:
        actuators = {"surge_force_rate": 50.0, "yaw_moment_rate": 80.0, "surge_lag": 0.25, "yaw_lag": 0.5, **values}
        scenario: Any = SimpleNamespace(vessel_sim=SimpleNamespace(actuators=SimpleNamespace(**actuators)))
        return run._delay(scenario, 100.0, 200.0)

    assert delay() == pytest.approx(2.0 * 200.0 / 80.0 + 5.0 * 0.5)
    assert delay(surge_lag=2.0) == pytest.approx(2.0 * 100.0 / 50.0 + 5.0 * 2.0)


def test_the_force_astern_is_that_of_each_kind_of_thruster() -> None:
    def astern(kind: int, angle: float = 0.0, limit: float = 1.0) -> float:
        thruster: Any = SimpleNamespace(kind=kind, angle=angle, angle_limit=limit, thrust_ahead=90.0, thrust_astern=40.0)
        return run._thrust_astern(thruster)

    assert astern(FIXED) == pytest.approx(40.0)
    assert astern(FIXED, math.radians(60.0)) == pytest.approx(20.0)
    assert astern(FIXED, math.radians(120.0)) == pytest.approx(45.0)
    assert astern(AZIMUTH, limit=ALL_ROUND) == 90.0
    assert astern(AZIMUTH, math.radians(60.0)) == 40.0


@pytest.mark.parametrize("side", ["port", "starboard"])
@pytest.mark.parametrize(("ends", "attempts"), [(1, 1), (3, 3), (4, 4), (9, 4)])
@pytest.mark.parametrize("failure", ["", "the motion is no longer finite"])
def test_every_attempt_of_a_manoeuvre_is_longer_and_turns_to_the_same_side(
    monkeypatch: pytest.MonkeyPatch, side: str, ends: int, attempts: int, failure: str
) -> None:
    """It ends with the attempt that is complete or that fails, else with the last one."""
    made: list[Any] = []

    def once(scenario: Any, name: str) -> Any:
        made.append(scenario)
        last = len(made) == ends
        return run.Manoeuvre(name, scenario, drawn(time=[0.0]), {}, last and not failure, failure if last else "")

    monkeypatch.setattr(run, "_once", once)
    own = run.ship_named("otter")
    done = run.perform(own, "speed_run", side)
    assert done.scenario is made[-1]
    assert (len(made), done.complete, done.failure) == (attempts, ends <= 4 and not failure, failure if ends <= 4 else "")
    assert {scenario.controller.manoeuvre.side for scenario in made} == {side}
    holds = [scenario.controller.manoeuvre.hold_time for scenario in made]
    durations = [scenario.vessel_sim.duration for scenario in made]
    assert [hold / holds[0] for hold in holds] == pytest.approx([1.0, 2.0, 4.0, 8.0][:attempts])
    assert [duration / durations[0] for duration in durations] == pytest.approx([1.0, 2.0, 4.0, 8.0][:attempts], rel=0.01)
