"""Errors against planned legs and turns: geometry, metrics, and what judges a survey by them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.metrics import NO_LEG, missed, per_leg, summarise
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, track_of
from vessel_hsmc_ros.guidance.planned_track import leg_count, passed_legs, replaced, stretches_of, track_errors
from vessel_hsmc_ros.report import page
from vessel_hsmc_ros.report.record import Record, analyse, measured, planned
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.batch import simulate_one
from vessel_hsmc_ros.studies.suite import Row, judge

SURVEY = ReferenceShipParameters(mode="lawnmower", initial_pose=(3.0, 4.0, 0.7))


def survey(**changes: object) -> Scenario:
    given = {"mode": "lawnmower", "lawnmower.legs": 2, "lawnmower.leg_length": 60.0, "initial_pose": [0.0, 0.0, 0.0]}
    return load_scenario("waypoints", {**{f"reference_ship.{name}": value for name, value in given.items()}, **changes})


@pytest.mark.parametrize("port", [0.4, -0.7])
def test_a_ship_beside_and_ahead_of_its_plan_has_these_errors_on_legs_and_in_turns(port: float) -> None:
    track = track_of(SURVEY, 0.1)
    assert track is not None
    ((route, profile, begin, end),) = track.stretches
    time = np.linspace(begin + 5.0, end - 20.0, 3000)
    s = profile.at(time)[0]
    p = route.position(s + 0.3) + port * 1j * np.exp(1j * route.course(s + 0.3))
    errors = track_errors(track, time, np.column_stack((p.real, p.imag)))
    # At the joint of a leg and a turn the line of the one is not the curve of the other.
    inner = np.ones(len(time), bool)
    for change in np.flatnonzero(np.diff(errors.turn)):
        inner[change - 20 : change + 20] = False
    assert set(errors.leg) == {0, 1, 2, 3}
    assert errors.turn.any()
    np.testing.assert_allclose(errors.cross[inner], port, atol=1e-6)
    np.testing.assert_allclose(errors.along[inner], 0.3, atol=1e-6)
    assert [row.leg for row in per_leg(errors)] == [0, 1, 2, 3]
    metrics = summarise(errors.where(inner))
    assert metrics[:4] == pytest.approx((abs(port), abs(port), 0.3, abs(port)))


def test_a_stretch_ends_at_its_own_end_or_where_another_plan_takes_its_place() -> None:
    track = track_of(SURVEY, 0.1)
    assert track is not None
    (one,) = track.stretches
    for now, end in ((one.end + 50.0, one.end), (0.5 * (one.begin + one.end), 0.5 * (one.begin + one.end))):
        later = track._replace(stretches=stretches_of(track.stretches, now - one.begin))
        both = replaced(track, now, later)
        assert [(each.begin, each.end) for each in both.stretches] == pytest.approx(
            [(one.begin, end), (now, now + one.end - one.begin)]
        )
        assert both.waypoints == track.waypoints * 2
        at_rest = np.linspace(end, now, 5)[1:-1]
        assert set(track_errors(both, at_rest, np.zeros((3, 2))).leg) <= ({NO_LEG} if now > end else {0, 1, 2, 3})
    assert replaced(track, one.begin, track).stretches == track.stretches


def test_before_the_path_at_a_stop_and_after_the_end_the_plan_is_on_no_leg() -> None:
    p = load_scenario(
        "waypoints",
        {
            "reference_ship.initial_pose": [0.0, 0.0, 0.0],
            "reference_ship.path.time": 5.0,
            "reference_ship.path.waypoints": [60.0, 0.0, 60.0, 60.0],
            "reference_ship.path.corners": ["stop"],
        },
    ).reference_ship
    track = track_of(p, 0.1)
    assert track is not None
    assert leg_count(track) == 2
    first, second = track.stretches
    time = np.array([4.0, first.begin + 1.0, first.end + 1e-3, second.begin + 1.0, second.end])
    errors = track_errors(track, time, np.zeros((5, 2)))
    assert list(errors.leg) == [NO_LEG, 0, NO_LEG, 1, NO_LEG]
    assert np.isnan(errors.cross[[0, 2, 4]]).all()
    # The second leg is northwards, 60 m east of the ship at the origin.
    assert errors.cross[3] == pytest.approx(60.0)


@pytest.mark.long
def test_a_path_of_a_message_takes_the_place_of_the_rest_of_the_plan() -> None:
    p = load_scenario("waypoints").reference_ship
    before = track_of(p, 0.1)
    after = track_of(p, 0.1, [(40.0, [(0.0, 200.0), (0.0, 300.0)])])
    assert before is not None
    assert after is not None
    assert after.stretches[0].end == 40.0 < before.stretches[0].end
    assert after.stretches[-1].begin >= 40.0
    assert after.waypoints[-2:] == (200j, 300j)


def record_of_half(record: Record) -> Record:
    """The run with a ship that stays 30 m abeam for the second half."""
    run = record.run
    state = run.state.copy()
    state[len(state) // 2 :, 1] += 30.0
    aside = replace(run, state=state)
    return analyse("aside", aside, record.scenario, track=record.track)


@pytest.mark.long
def test_a_survey_is_judged_by_its_legs_in_metrics_verdict_suite_and_page() -> None:
    scenario = survey(**{"vessel_sim.duration": 60.0})
    run, track = simulate(scenario), planned(scenario)
    metrics = measured(run, scenario)
    assert metrics is not None
    assert track is not None
    # As a batch has it, which keeps no positions of other runs.
    assert simulate_one(scenario).metrics == metrics
    errors = track_errors(track, run.time, run.state[:, :2])
    line = run.state[:, 1][(errors.leg == 0) & ~errors.turn]
    assert metrics.leg_cross_track_rms == pytest.approx(math.sqrt(np.mean(line**2)))
    record = analyse("survey", run, scenario, track=track)
    assert record.verdict.startswith("On 1 of its 2 legs the ship is ")
    limit = metrics.leg_cross_track_rms or 0.0
    away = record_of_half(record).verdict
    assert "; it missed " in away and "of their length, where it was never within " in away  # noqa: PT018
    assert judge(Row("r", legs_at_most=1.01 * limit), run, track).hit
    assert not judge(Row("r", legs_at_most=0.99 * limit), run, track).hit
    assert not judge(Row("r", legs_at_most=1.0), run).hit
    text = page.render([record], "survey", page.hull_of([record]))
    assert '<section class="group" id="legs">' in text
    assert "planned legs, waypoints" in text


@pytest.mark.parametrize("far", rest_long([0.0, 0.4, 0.99, 1.01, 5.0]))
@pytest.mark.parametrize(("begin", "end"), rest_long([(0.0, 0.5), (0.3, 0.8), (0.0, 1.0)]))
def test_what_is_not_passed_within_a_tenth_of_the_spacing_is_missed(far: float, begin: float, end: float) -> None:
    """Of a ship that sails its plan, but for a part of the second leg on which it is abeam."""
    track = track_of(SURVEY, 0.1)
    assert track is not None
    ((route, profile, start, stop),) = track.stretches
    time = np.linspace(start, stop, 40000)
    s = profile.at(time - start)[0]
    first = sum(element.length for element in route.elements[:2])
    leg = route.elements[2].length
    away = (s > first + begin * leg) & (s < first + end * leg)
    p = route.position(s) + np.where(away, 1j * far * track.near * np.exp(1j * route.course(s)), 0.0)
    assert track.near == pytest.approx(0.1 * SURVEY.lawnmower.spacing)
    lengths = passed_legs(track, stop, np.column_stack((p.real, p.imag)))
    expected = end - begin if far > 1.0 else 0.0
    # Beyond either end of the gap, a point of the leg is still within the distance of the last position near it.
    assert [missed({k: lengths[k]}) for k in range(4)] == pytest.approx([0.0, expected, 0.0, 0.0], abs=2.1 * track.near / leg)
    assert missed(lengths) == pytest.approx(0.25 * expected, abs=2.1 * track.near / leg)
    assert missed({}) is None
    assert passed_legs(track, start - 1.0, np.zeros((3, 2))) == {}


def test_a_run_in_is_no_leg() -> None:
    p = survey(**{"reference_ship.lawnmower.run_in": 25.0}).reference_ship
    track = track_of(p, 0.1)
    assert track is not None
    assert leg_count(track) == 2
    assert track.waypoints[:2] == pytest.approx((25.0, 85.0))
    ((_, profile, begin, _),) = track.stretches
    time = begin + profile.time_at(np.array([24.9, 25.1]))
    errors = track_errors(track, time, np.array([[24.9, 1.0], [25.1, 1.0]]))
    assert list(errors.leg) == [NO_LEG, 0]
    assert [row.leg for row in per_leg(errors)] == [0]


def test_a_reference_without_a_plan_has_no_legs() -> None:
    scenario = load_scenario("figure_eight", {"vessel_sim.duration": 2.0})
    metrics = measured(simulate(scenario), scenario)
    assert metrics is not None
    assert metrics.leg_cross_track_rms is None
    assert planned(scenario) is None
