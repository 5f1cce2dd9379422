import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from durations import rest_long

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, NOT_DECLARED
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.metrics import position_error
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.guidance.curve_motion import Demand
from vessel_hsmc_ros.plant.dynamics import unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.own_ship import OVERRIDES, MainData, scenario_for, scenario_text, thruster_layout
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import Circle, Scale, scale_of, sway_damping_rate
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.scenario.warnings import check_scenario
from vessel_hsmc_ros.simulation.offline import simulate

BOAT = MainData(length=4.0, mass=500.0, surge_force_limit=300.0, yaw_moment_limit=250.0, wind=5.0)
HULLS = {
    "1.2 m": MainData(length=1.2, mass=15.0),
    "4 m": MainData(length=4.0, mass=500.0, surge_force_limit=300.0, yaw_moment_limit=250.0),
    "8 m": MainData(length=8.0, mass=3000.0),
    "32 m": MainData(length=32.0, mass=118e3, surge_force_limit=2e5, yaw_moment_limit=3e6, speed=3.3),
    "76 m": MainData(length=76.0, mass=6e6),
}

AT_20_HZ: dict[str, object] = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}


def scenario_of(data: MainData, changes: dict[str, object] | None = None) -> Scenario:
    return parse_scenario(scenario_text("mine", data), "mine", changes)


@pytest.mark.parametrize("data", HULLS.values(), ids=HULLS.keys())
def test_a_new_scenario_keeps_its_circle_within_a_hundredth_of_the_length(data: MainData) -> None:
    # The settling time scales with the square root of the length.
    duration = 40.0 * np.sqrt(data.length)
    run = simulate(scenario_of(data, {"vessel_sim.duration": round(float(duration)), **AT_20_HZ}))
    settled = run.time > 0.8 * run.time[-1]
    assert position_error(run.state, run.reference)[settled].max() < 0.01 * data.length


FAST: dict[str, object] = {f"controller.vessel.{name}": value for name, value in INSTANT.items()}


@pytest.mark.parametrize(("declared", "limit"), [({}, 0.04), (FAST, 0.02)], ids=["nothing declared", "declared fast"])
def test_a_boat_of_4_m_keeps_a_circle_of_20_m_at_1_m_per_s_in_wind_within_centimetres(
    declared: dict[str, object], limit: float
) -> None:
    changes = {"reference_ship.circle.speed": 1.0, "vessel_sim.duration": 160.0, **AT_20_HZ, **declared}
    run = simulate(scenario_of(BOAT, changes))
    last_lap = run.time > run.time[-1] - 126.0
    assert position_error(run.state, run.reference)[last_lap].max() < limit
    assert np.hypot(*(run.reference[-1, :2] - [0.0, 20.0])) == pytest.approx(20.0, abs=1e-6)


def test_the_full_surge_force_gives_the_top_speed() -> None:
    ship = scenario_of(MainData(length=8.0, speed=5.0)).vessel_sim.vessel
    f_u, _, _ = unforced_acceleration(5.0, 0.0, 0.0, ship.coefficients())
    assert f_u + ship.surge_force_limit / ship.surge_inertia == pytest.approx(0.0, abs=0.01)


def test_the_top_speed_and_the_turn_on_the_spot_are_the_first_ones_at_which_damping_takes_the_propulsion() -> None:
    """Of damping that falls in between, 11·u - 6·|u|·u + u³ = 6 at 1, 2 and 3: a ship from rest comes to the first."""
    falling: Any = {
        f"{axis}_damping{power}": value
        for axis in ("surge", "yaw")
        for power, value in (("", 11.0), ("_quadratic", -6.0), ("_cubic", 1.0))
    }
    ship = ShipParameters(**falling, surge_force_limit=6.0, yaw_moment_limit=6.0, yaw_inertia=1.0, length=100.0)
    assert (scale_of(ship).U, scale_of(ship).r_max) == pytest.approx((1.0, 1.0))


@pytest.mark.parametrize("length", [0.3, 4.0, 300.0])
def test_a_new_scenario_is_complete_and_gives_no_warning(length: float) -> None:
    scenario = scenario_of(MainData(length=length))
    assert check_scenario(scenario) == []
    for node in ("vessel_sim", "reference_ship", "controller"):
        hull = schema.entries(type(getattr(scenario, node).vessel), f"{node}.vessel.")
        # A flag, a coefficient of 0, a limit of infinity and what is not declared are those of any ship.
        papers = {
            name for name, entry in hull.items() if entry.type is float and entry.default not in (0.0, math.inf, NOT_DECLARED)
        }
        assert papers <= scenario.given


def test_what_is_given_is_taken_as_it_is_and_comments_are_in_one_column() -> None:
    text = scenario_text("mine", BOAT)
    assert yaml.safe_load(text)["/**"]["ros__parameters"]["vessel"]["surge_force_limit"] == 300.0
    assert scenario_of(BOAT).controller.vessel.yaw_moment_limit == 250.0
    columns = {line.index("  #") for line in text.splitlines() if "  #" in line and line.lstrip()[0] != "#"}
    assert len(columns - {max(columns)}) <= 4
    assert max(map(len, text.splitlines())) < 130


TWIN = thruster_layout(("-1.5,0.5,100,60", "-1.5,-0.5,100,60"), 4.0)
SPARSE = MainData(gps_noise=0.1)
OTHER = MainData(5.0, 2.1, 600.0, 150.0, 70.0, 2.9, 3.0, 0.2, 0.4, 0.3, 2.0, 900.0, 500.0)


@pytest.mark.parametrize("layout", rest_long([None, TWIN]), ids=["wrench", "thrusters"])
@pytest.mark.parametrize("name", rest_long(vars(SPARSE)))
def test_each_datum_that_is_given_counts_with_thrusters_and_without(name: str, layout: ThrusterLayout | None) -> None:
    texts = (scenario_text("mine", data, layout) for data in (SPARSE, replace(SPARSE, **{name: getattr(OTHER, name)})))
    estimated, given = map(yaml.safe_load, texts)
    assert given != estimated
    if name in OVERRIDES:
        assert given["/**"]["ros__parameters"]["vessel"][name] == getattr(OTHER, name)


@pytest.mark.parametrize("thrusters", [False, True], ids=["wrench", "thrusters"])
@pytest.mark.parametrize("name", ["wind", "current", "lag", "gps_noise", "gps_rate"])
def test_what_is_given_beside_a_vessel_of_the_library_counts_with_thrusters_and_without(name: str, thrusters: bool) -> None:
    values = read_vessel("otter").values
    around = (SPARSE, replace(SPARSE, **{name: getattr(OTHER, name)}))
    calm, given = (yaml.safe_load(scenario_for(values, "otter", around=each, thrusters=thrusters)) for each in around)
    assert given != calm


def test_wind_is_written_as_a_force_with_gusts() -> None:
    wind = scenario_of(BOAT).vessel_sim.disturbance.earth_fixed
    assert (wind.east_force, wind.gust_deviation) == (36.0, 3.6)
    assert not scenario_of(HULLS["4 m"]).vessel_sim.disturbance.earth_fixed.active()


def test_main_data_out_of_range_are_rejected() -> None:
    with pytest.raises(ParameterError, match=r"init\.length must be .* from 0\.1 to 1000 m \(got -4\.0\)"):
        schema.build(MainData, {"length": -4.0}, "init")


def test_the_template_is_data_of_the_package() -> None:
    assert (Path(__file__).parents[2] / "config" / "templates" / "ship.yaml").is_file()


@pytest.mark.parametrize(("rho", "rate"), [(0.5, NOT_DECLARED), (0.9, 0.2), (1.5, 0.2 / 2.25), (2.0, 0.05)])
def test_a_hull_of_which_the_course_turns_the_other_way_first_gets_a_slower_law(rho: float, rate: float) -> None:
    """With linear damping and no coupling, a = d_v/m22 and rho = m11/m22 at every motion."""
    linear: Any = {f"{name}_damping_{power}": 0.0 for name in ("surge", "sway", "yaw") for power in ("quadratic", "cubic")}
    inertia: Any = {
        "surge_inertia": rho * 2000.0,
        "sway_inertia": 2000.0,
        "sway_damping": 0.2 * 2000.0,
        "sway_yaw_inertia": 0.0,
    }
    ship = replace(ShipParameters(), **inertia, **linear, yaw_inertia=2000.0, length=4.0)
    scale = Scale(L=4.0, F=300.0, N=500.0, U=2.0, r_max=0.5, m11=rho * 2000.0, m33=2000.0, T=2.0)
    circle = Circle(20.0, 1.0, 10.0, Demand(0.1, 100.0, 100.0))
    assert sway_damping_rate(ship, scale, circle) == pytest.approx(rate, rel=1e-6)
