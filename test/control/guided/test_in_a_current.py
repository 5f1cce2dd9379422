"""Ships that track and rest in a current of which they know nothing."""

import math

import pytest
from compiling import only_compiled

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.scenario.own_ship import scenario_for, ship_of
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate


def test_a_circle_in_half_a_metre_per_second_of_current_is_tracked_to_five_centimetres() -> None:
    lag = 0.7
    changes: dict[str, object] = {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
    changes |= {f"{node}.{each}_lag": lag for node in ("vessel_sim.actuators", "controller.vessel") for each in ("surge", "yaw")}
    changes |= {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes |= {"controller.law": "guided", "vessel_sim.disturbance.current.east": 0.5, "vessel_sim.duration": 250.0}
    run = simulate(load_scenario("case2_tracking", changes))
    late = run.time > 200.0
    error = rms(position_error(run.state[late], run.reference[late]))
    assert error < 0.05


@only_compiled
@pytest.mark.parametrize("coupling", [0.0, 6e5])
@pytest.mark.parametrize("speed", [0.1, 0.25])
@pytest.mark.parametrize("lag", [None, 2.0])
def test_a_ship_keeps_its_position_in_a_current_from_the_side(coupling: float, speed: float, lag: float | None) -> None:
    """0.1 and 0.25 m/s of current: 2 to 4 m before the lever arm followed the current."""
    changes: dict[str, object] = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes |= {"vessel_sim.disturbance.current.north": speed, "vessel_sim.duration": 900.0, "controller.law": "guided"}
    if coupling:
        changes |= {f"vessel_sim.vessel.{each}": 0.4 * coupling for each in ("sway_damping_from_yaw", "yaw_damping_from_sway")}
        changes |= {f"{node}.vessel.sway_yaw_inertia": coupling for node in ("vessel_sim", "controller")}
    if lag is not None:
        changes |= {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
        changes |= {
            f"{node}.{each}_lag": lag for node in ("vessel_sim.actuators", "controller.vessel") for each in ("surge", "yaw")
        }
    run = simulate(load_scenario("case3_stabilisation", changes))
    last = run.time >= 600.0
    assert rms(position_error(run.state[last], run.reference[last])) < 0.1


@only_compiled
@pytest.mark.parametrize("name", ["gunnerus", "heron", "viknes_830"])
def test_a_vessel_that_a_turn_carries_sideways_tracks_a_circle_in_a_current(name: str) -> None:
    """0.03 sqrt(g·L) of current: at most 0.01 L rms (0.05, 0.013 and 0.03 L before the current was learned)."""
    values = read_vessel(name).values
    scenario, scale = parse_scenario(scenario_for(values, name), name), scale_of(ship_of(values))
    current = 0.03 * math.sqrt(GRAVITY * scale.L)
    run = simulate(scenario.changed({"vessel_sim.disturbance.current.north": current, "controller.law": "guided"}))
    last = run.time >= 0.75 * run.time[-1]
    assert rms(position_error(run.state[last], run.reference[last])) < 0.01 * scale.L
