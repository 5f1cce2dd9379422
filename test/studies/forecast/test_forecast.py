"""Forecasts: known answers of time and energy, what is infeasible, properties, and what a run is drawn from."""

import math
import warnings
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.plant.hull_parameters import electric_power
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import loads
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.forecast.forecast import (
    Conditions,
    Forecast,
    Plan,
    Sailed,
    band,
    conditions_of,
    drawn,
    energy_of,
    evaluated,
    forecast,
    mean_changes,
    plan_of,
    sail,
    summary,
    why_infeasible,
)
from vessel_hsmc_ros.studies.forecast.page import overview, table, verdict, write

FORCE, POWER, LENGTH = 300.0, 1200.0, 4.0
CALM = Conditions()
WINDY = Conditions(6.0, 240.0, 0.3, 90.0)
BOAT = MainData(length=LENGTH, mass=500.0, surge_force_limit=FORCE, yaw_moment_limit=250.0, power=POWER, battery=2000.0)


@lru_cache
def boat() -> Scenario:
    return parse_scenario(scenario_text("boat", BOAT), "boat")


def plan(
    points: list[float], speed: float = 1.0, conditions: Conditions = CALM, changes: Mapping[str, object] = MappingProxyType({})
) -> Plan:
    """A mission of the boat from the origin, along waypoints x, y."""
    path = {"mode": "path", "path.waypoints": points, "path.speeds": [speed]}
    values = {f"reference_ship.{name}": value for name, value in path.items()}
    return plan_of(boat().changed({**values, **changes}), conditions)


def mean_run(one: Plan) -> Sailed:
    """The run in the mean conditions, with the declared hull and without gusts."""
    return evaluated(0, simulate(one.scenario), one)


@lru_cache
def windy(workers: int = 2, seed: int = 1) -> Forecast:
    return forecast(plan([40.0, 0.0, 40.0, 30.0], conditions=WINDY), 24, seed, workers)


def test_another_minute_of_way_takes_a_minute_and_the_energy_of_steady_speed() -> None:
    short, long = (mean_run(plan([way, 0.0])) for way in (60.0, 120.0))
    hull, speed = boat().vessel_sim.vessel, 1.0
    force = hull.surge_damping * speed + hull.surge_damping_quadratic * speed**2
    assert long.time - short.time == pytest.approx(60.0, abs=0.05)
    assert long.energy - short.energy == pytest.approx(POWER * (force / FORCE) ** 1.5 * 60.0 / 3600.0, rel=1e-3)
    assert max(short.worst[0], long.worst[0]) < 1e-3
    assert (short.failure, long.failure) == ("", "")


@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_a_corner_takes_the_time_of_its_arc_at_the_speed_of_the_legs(speed: float) -> None:
    straight, bent = plan([100.0, 0.0], speed), plan([60.0, 0.0, 60.0, 40.0], speed)
    way = bent.track.stretches[0].route.length - straight.track.stretches[0].route.length
    assert way < 0.0, "the corner is cut"
    assert mean_run(bent).time - mean_run(straight).time == pytest.approx(way / speed, abs=0.05)


def test_a_mission_that_ends_where_it_begins_takes_all_of_its_time() -> None:
    round_trip = plan([40.0, 0.0, 40.0, 30.0, 0.0, 0.0])
    found = mean_run(round_trip)
    assert (found.failure, len(found.worst)) == ("", 3)
    assert found.time > 100.0


def test_what_is_not_thrust_takes_its_power_all_the_time() -> None:
    with_computer = mean_run(plan([60.0, 0.0], changes={"vessel.power.other": 36.0}))
    rate = boat().vessel_sim.rate_hz
    until = math.ceil(with_computer.time * rate) / rate  # energy counts up to the sample at which the boat is there
    assert with_computer.energy - mean_run(plan([60.0, 0.0])).energy == pytest.approx(0.01 * until, rel=1e-9)


def test_a_power_that_is_not_declared_is_that_of_the_top_speed_at_an_efficiency_of_40_percent() -> None:
    n = 361
    full = np.column_stack((np.full(n, FORCE), np.zeros(n)))
    guessed = energy_of(np.linspace(0.0, 3600.0, n), full, boat().changed({"vessel.power.full_thrust": 0.0}))
    assert guessed == pytest.approx(FORCE * 0.4 * math.sqrt(9.81 * LENGTH) / 0.4, rel=0.01)


def test_turning_takes_power_from_two_propellers_and_none_from_a_rudder() -> None:
    n = 11
    turning = np.column_stack((np.zeros(n), np.full(n, 250.0)))
    hour = np.linspace(0.0, 3600.0, n)
    assert energy_of(hour, turning, boat()) == pytest.approx(POWER)
    layout = {"names": ["aft"], "kinds": ["rudder"], "x": [-1.8], "thrust_ahead": [FORCE], "lift": [50.0], "angle_limit": [0.6]}
    steered = boat().changed({f"vessel.thrusters.{name}": value for name, value in layout.items()})
    assert energy_of(hour, turning, steered) == 0.0


@given(s=st.floats(-1.0, 1.0), m=st.floats(-1.0, 1.0))
def test_power_is_even_in_force_and_moment_and_grows_with_both(s: float, m: float) -> None:
    def power(surge: float, yaw: float) -> float:
        return float(electric_power(np.array([surge]), np.array([yaw]), 100.0, 5.0)[0])

    assert power(s, m) == pytest.approx(power(-s, m)) == pytest.approx(power(s, -m))
    assert power(s, m) >= max(power(0.9 * s, m), power(s, 0.9 * m)) - 1e-9
    assert power(1.0, 0.0) == 105.0


def test_more_headwind_never_takes_less_energy() -> None:
    energies = [sail(plan([60.0, 0.0], conditions=Conditions(w, 90.0)), 3, 0, print_nothing).energy for w in range(0, 11, 2)]
    assert np.all(np.diff(energies) > 0.0)


def print_nothing(_: float) -> None:
    """Ignore progress."""


@pytest.mark.parametrize(("towards", "leg"), [(90.0, 2), (270.0, 2), (0.0, 1), (180.0, 1)])
def test_a_cross_current_beyond_the_boats_speed_is_named_with_leg_and_numbers(towards: float, leg: int) -> None:
    found = why_infeasible(plan([40.0, 0.0, 40.0, 60.0], conditions=Conditions(current=2.5, current_to=towards)))
    assert f"infeasible on leg {leg}: 2.5 m/s of cross current, the boat has 2.37 m/s" in found


def test_speed_over_ground_against_a_current_is_named_with_what_it_takes_through_the_water() -> None:
    (line,) = why_infeasible(plan([60.0, 0.0], conditions=Conditions(current=1.9, current_to=270.0)))
    assert line == "infeasible on leg 1: 1 m/s over ground takes 2.9 m/s through the water, the boat has 2.37 m/s"


def test_a_wind_that_takes_all_of_the_thrust_is_infeasible_on_every_leg() -> None:
    found = why_infeasible(plan([40.0, 0.0, 40.0, 60.0], conditions=Conditions(wind=40.0, wind_from=90.0)))
    assert [line.partition(":")[0] for line in found] == ["infeasible on leg 1", "infeasible on leg 2"]
    assert "the boat has 0 m/s in this wind" in found[0]


@settings(max_examples=40, deadline=None)
@given(current=st.floats(0.0, 3.0), wind=st.floats(0.0, 8.0), towards=st.floats(0.0, 360.0))
def test_a_leg_stays_infeasible_in_a_stronger_cross_current(current: float, wind: float, towards: float) -> None:
    def lines(speed: float) -> list[str]:
        return why_infeasible(plan([60.0, 0.0], conditions=Conditions(wind, towards, speed, 0.0)))

    assert bool(lines(current)) <= bool(lines(current + 0.5))


def test_a_hold_in_a_current_beyond_the_boats_thrust_is_infeasible() -> None:
    holding = {"reference_ship.path.holds": [0.0, 30.0]}
    strong = Conditions(current=2.3, current_to=90.0)
    assert not any("hold" in line for line in why_infeasible(plan([40.0, 0.0, 40.0, 60.0], conditions=WINDY, changes=holding)))
    assert any("a hold" in line for line in why_infeasible(plan([40.0, 0.0, 40.0, 60.0], conditions=strong, changes=holding)))


@pytest.mark.long
def test_the_same_seed_gives_the_same_runs_on_one_core_and_on_several() -> None:
    one, two, other = windy(1), windy(2), windy(2, seed=2)
    assert [run[:4] for run in one.runs] == [run[:4] for run in two.runs]
    assert np.array_equal(one.worst, two.worst)
    assert not set(one.energy) & set(other.energy)


def test_the_time_is_that_between_two_samples_so_that_runs_differ_by_less_than_a_sample() -> None:
    times = windy().time
    assert len(np.unique(times)) == len(times)
    period = 1.0 / boat().vessel_sim.rate_hz
    assert np.ptp(np.mod(times, period)) > 0.1 * period


def test_directions_are_those_of_a_compass() -> None:
    changes = mean_changes(Conditions(6.0, 240.0, 0.3, 90.0), LENGTH)
    east, north = (changes[f"vessel_sim.disturbance.earth_fixed.{name}_force"] for name in ("east", "north"))
    force = loads(LENGTH, 6.0)["wind_force"]
    assert (east, north) == pytest.approx((force * math.sin(math.radians(60.0)), force * math.cos(math.radians(60.0))))
    assert changes["vessel_sim.disturbance.current.east"] == pytest.approx(0.3)
    again = conditions_of(boat().changed(changes))
    assert (again.wind, again.wind_from, again.current, again.current_to) == pytest.approx((6.0, 240.0, 0.3, 90.0))


def test_runs_are_drawn_about_the_conditions_and_the_declared_hull_and_nothing_blows_in_calm() -> None:
    n, base = 400, plan([60.0, 0.0], conditions=WINDY).scenario
    sims = [drawn(base, WINDY, 5, number).vessel_sim for number in range(n)]
    current = np.array([complex(s.disturbance.current.east, s.disturbance.current.north) for s in sims])
    inertia = np.log([s.vessel.yaw_inertia / base.vessel_sim.vessel.yaw_inertia for s in sims])
    ratios = np.array([s.vessel.surge_damping / s.vessel.surge_damping_quadratic for s in sims])
    assert np.std(np.abs(current)) == pytest.approx(0.2 * 0.3, rel=0.15)
    assert np.degrees(np.std(np.angle(current))) == pytest.approx(15.0, rel=0.15)
    assert np.std(inertia) == pytest.approx(0.1, rel=0.15)
    assert np.ptp(ratios) == pytest.approx(0.0, abs=1e-9)
    assert len({s.seed for s in sims}) == n
    calm = drawn(base, CALM, 5, 1).vessel_sim.disturbance
    assert (calm.earth_fixed.active(), calm.current.east, calm.current.north) == (False, 0.0, 0.0)


def test_only_the_plant_is_drawn_not_what_the_law_knows() -> None:
    base = plan([60.0, 0.0]).scenario
    one = drawn(base, WINDY, 1, 1)
    assert (one.controller, one.reference_ship) == (base.controller, base.reference_ship)


@pytest.mark.parametrize("n", [19, 39, 199])
def test_the_band_of_uniform_values_has_the_probabilities_of_a_further_one(n: int) -> None:
    assert band(np.arange(1.0, n + 1.0) / (n + 1.0)) == pytest.approx([0.05, 0.5, 0.95])
    assert np.isnan(band(np.array([math.nan]))).all()


def test_runs_that_leave_the_corridor_or_empty_the_battery_fail_and_are_counted() -> None:
    near = plan_of(plan([40.0, 0.0], conditions=WINDY).scenario, WINDY, 0.001)
    found = forecast(near, 20, 1)
    assert not found.succeeds
    assert verdict(found) == [
        "No: 0 of 20 runs do the mission in a wind of 6 m/s from 240° and a current of 0.3 m/s to 90°.",
        "20 of 20 runs: it strays more than 1 mm from leg 1",
    ]
    flat = sail(plan([40.0, 0.0], changes={"vessel.power.battery_wh": 0.5}), 1, 0, print_nothing)
    assert flat.failure == "the battery of 0.5 W·h is empty before the end"


def test_a_vessel_that_does_not_come_to_the_end_is_a_failure_without_time_and_energy() -> None:
    one = plan([60.0, 0.0])
    run = simulate(one.scenario.changed({"vessel_sim.duration": 30.0}))
    found = evaluated(0, run, one)
    assert found.failure.startswith("it does not come to the last waypoint within ")
    assert math.isnan(found.time)
    assert math.isnan(found.energy)


def test_a_survey_and_a_reference_that_waits_have_forecasts() -> None:
    short = {"mode": "lawnmower", "lawnmower.legs": 2, "lawnmower.leg_length": 20.0, "lawnmower.spacing": 12.0}
    small = {f"reference_ship.{name}": value for name, value in {**short, "lawnmower.run_in": 10.0}.items()}
    survey = mean_run(plan_of(boat().changed(small), CALM))
    assert (survey.failure, len(survey.worst)) == ("", 2)
    waiting = plan([8.0, 0.0], changes={"reference_ship.follow": "vessel"})
    on_time = mean_run(plan([8.0, 0.0])).time
    found = forecast(waiting, 2, 1, 1)  # interpreted
    assert all(on_time < run.time < 2.0 * on_time for run in found.runs)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: plan_of(boat(), CALM),
            ScenarioError,
            "must have a mission: a path or a survey .got reference_ship.mode = circle",
        ),
        (lambda: plan_of(load_scenario("survey"), CALM, math.nan), ParameterError, "--corridor must be a distance above 0 m"),
        (lambda: plan_of(load_scenario("case2_tracking"), CALM), ParameterError, "vessel.surge_force_limit is missing"),
    ],
    ids=["no mission", "no corridor", "no boat"],
)
def test_what_cannot_be_forecast_is_refused(make: object, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()  # type: ignore[operator]


def test_a_forecast_of_which_no_run_arrives_has_a_page_too(tmp_path: Path) -> None:
    one = plan([40.0, 0.0])
    nothing = Sailed(0, "it ends early: the motion diverges", math.nan, math.nan, np.full(1, math.nan), np.empty((0, 5)))
    found = Forecast(one, 1, (nothing,) * 20)
    assert "No: 0 of 20 runs" in write(tmp_path, found)["page"].read_text(encoding="utf-8")
    assert [line[2] for line in overview(found)[1]] == ["–", "–", "–", "0 m"]


@pytest.mark.long
def test_a_straight_leg_in_calm_water_has_a_picture_without_a_warning(tmp_path: Path) -> None:
    one = plan([40.0, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert write(tmp_path, Forecast(one, 1, (mean_run(one),) * 20))["picture"].exists()


def test_a_short_leg_between_two_corners_has_distances_of_its_own() -> None:
    one = plan([60.0, 0.0, 60.0, 12.0, 0.0, 12.0], 1.5)
    assert [leg.number for leg in one.legs] == [0, 1, 2]
    assert np.isfinite(mean_run(one).worst).all()


def test_the_page_has_the_answer_the_picture_and_a_line_for_each_leg(tmp_path: Path) -> None:
    found = windy()
    files = write(tmp_path, found)
    page = files["page"].read_text(encoding="utf-8")
    assert page.index("Yes: 24 of 24 runs") < page.index("the worst (red), and its turn") < page.index("straight part")
    head, lines = table(found)
    assert [line[0] for line in lines] == ["1", "2"]
    assert head[-3:] == ["distance 5 %", "distance 50 %", "distance 95 %"]
    assert [line[0] for line in overview(found)[1]] == [
        "time until the last waypoint",
        "energy until then",
        "left in the battery",
        "largest distance from the path",
    ]
    assert files["picture"].read_bytes().startswith(b"\x89PNG")
    left = np.array(summary(found)["battery_left_wh"])
    assert np.all(np.diff(left) > 0.0)
    assert left == pytest.approx(2000.0 - np.array(summary(found)["energy_wh"])[::-1])
