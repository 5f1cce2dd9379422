"""What surrounds the kernels in compiled loops, with the kernels as plain Python: the same numbers as the loop of the classes."""

from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np
import pytest
from compiling import as_plain_python
from durations import rest_long
from ship_family import ShipFamily, expand

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.metrics import Published, Run
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compiled_loop import CompiledLoop, make_loop
from vessel_hsmc_ros.simulation.loop import BRIEF
from vessel_hsmc_ros.simulation.offline import ClosedLoop

STRANGER = expand(
    ShipFamily(
        length=90.0, has_dead_time=True, dead_time=0.28, has_rate=True, time_to_full=1.0, reference="circle", knowledge="nothing",
        speed=0.5, control_rate_hz=10.0,
    )
)  # fmt: skip
"""A ship with slow actuators, of which nothing is declared: the guided law finds them after 54 s."""

UNLIKE = {
    "vessel_sim.duration": 4.0,
    "vessel_sim.rate_hz": 40.0,
    "reference_ship.rate_hz": 20.0,
    "controller.rate_hz": 10.0,
    "vessel_sim.actuators.surge_dead_time": 0.3,
    "vessel_sim.actuators.yaw_lag": 0.4,
    "vessel_sim.sensors.delay": 0.275,
    "vessel_sim.sensors.position_noise": 0.1,
    "vessel_sim.disturbance.current.north": 0.3,
    "vessel.sway_yaw_inertia": 6e5,
    "vessel.controlled_point": "percussion",
    "controller.law": "guided",
}
"""Rates, delays and a hull that are all unlike, and a point that is not the origin."""

CASE2 = share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"
THRUSTERS = {
    "vessel.thrusters.names": ["screw", "bow"],
    "vessel.thrusters.kinds": ["rudder", "fixed"],
    "vessel.thrusters.x": [-15.0, 12.0],
    "vessel.thrusters.y": [0.0],
    "vessel.thrusters.angle": [0.0, 1.5],
    "vessel.thrusters.angle_limit": [0.6],
    "vessel.thrusters.thrust_ahead": [1e5, 2e4],
    "vessel.thrusters.thrust_astern": [6e4, 1e4],
    "vessel.thrusters.thrust_rate": [5e4],
    "vessel.thrusters.lag": [0.5],
    "vessel.thrusters.lift": [3e4],
    "vessel.thrusters.slipstream": [1e-4],
    "thruster_allocation.vessel.thrusters.x": [-13.0, 11.0],
    "thruster_allocation.vessel.thrusters.thrust_ahead": [8e4, 3e4],
    "vessel_sim.actuators.surge_dead_time": 0.0,
    "vessel_sim.actuators.yaw_lag": 0.0,
}


@pytest.fixture(autouse=True)
def _plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch)


def stranger(observed: bool) -> Scenario:
    changes = {
        "vessel_sim.duration": 57.0,
        "vessel_sim.rate_hz": 20.0,
        "controller.observer.enabled": observed,
        "controller.law": "guided",
    }
    return load_scenario("case2_tracking", {**STRANGER, **changes})


def scenario_of(made: str, observed: bool) -> Scenario:
    if made == "stranger":
        return stranger(observed)
    changes = {**UNLIKE, "controller.observer.enabled": observed}
    return load_scenario(CASE2, {**changes, **THRUSTERS}) if made == "thrusters" else load_scenario("case2_tracking", changes)


@cache
def run_of_classes(made: str, observed: bool) -> tuple[Run, Published]:
    """The interpreted run that a compiled one is compared with, and whose measurements a replay takes."""
    loop = ClosedLoop(scenario_of(made, observed), interpreted=True)
    loop.run()
    return loop.result(), loop.published()


def same(first: Any, second: Any) -> bool:
    return first is second or bool(np.array_equal(first, second, equal_nan=first.dtype.kind == "f"))


@pytest.mark.parametrize("observed", rest_long([False, True]))
@pytest.mark.parametrize("made", rest_long(["unlike", "thrusters", "stranger"]))
def test_the_text_of_the_compiled_loop_gives_the_run_of_the_classes(made: str, observed: bool) -> None:
    loop = ClosedLoop(scenario_of(made, observed))
    assert isinstance(loop._loop, CompiledLoop)
    loop.run()
    result, published = run_of_classes(made, observed)
    pairs: list[tuple[Any, Any]] = [(loop.result(), result), (loop.published(), published)]
    for first, second in pairs:
        for name in (field.name for field in fields(first) if field.name != "control"):
            assert same(getattr(first, name), getattr(second, name)), name
        assert all(same(first.control[name], second.control[name]) for name in first.control)


def test_a_run_that_is_only_evaluated_has_the_numbers_of_the_classes() -> None:
    """The command counts once in each control period, which is longer than that of the plant."""
    scenario, samples = scenario_of("unlike", False), 60
    loops = [make_loop(scenario, samples, interpreted=i, brief=np.empty((BRIEF, samples))) for i in (False, True)]
    assert isinstance(loops[0], CompiledLoop)
    for loop in loops:
        loop.advance(samples)
    brief, full = (loop.evaluated() for loop in loops)
    assert len(brief.command) == samples // 4
    for name, first, second in zip(brief._fields, brief, full, strict=True):
        np.testing.assert_array_equal(first, second, name)
