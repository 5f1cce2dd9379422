"""The control loop that parameters describe: whose limits, inertias and laws it has, and when its supervision acts."""

from dataclasses import replace
from typing import Any

import pytest

from vessel_hsmc_ros.scenario.control import make_control_loop, may_intervene
from vessel_hsmc_ros.scenario.parameters import ControllerParameters


def parameters(**safety: Any) -> ControllerParameters:
    """Of a controller in lockstep with unlike limits and inertias."""
    made = ControllerParameters(law="guided", lockstep=True, rate_hz=20.0)
    vessel = replace(made.vessel, surge_force_limit=300.0, yaw_moment_limit=70.0, surge_inertia=41.0, yaw_inertia=17.0)
    return replace(made, vessel=vessel, safety=replace(made.safety, **safety))


def test_the_supervision_has_the_limits_and_inertias_of_the_ship_each_in_its_place() -> None:
    authority = make_control_loop(parameters(), supervised=True).supervision.authority
    assert (authority.limits, authority.inertia) == ((300.0, 70.0), (41.0, 17.0))


@pytest.mark.parametrize(
    ("safety", "acts"),
    [
        ({}, False),
        ({"surge_force_rate": 100.0}, True),
        ({"yaw_moment_rate": 100.0}, True),
        ({"surge_force_limit": 5.0}, True),
        ({"yaw_moment_limit": 5.0}, True),
        ({"surge_force_limit": 0.0}, True),
        ({"yaw_moment_limit": 0.0}, True),
    ],
)
def test_each_limit_and_each_rate_that_is_given_lets_the_supervision_of_a_lockstep_run_act(
    safety: dict[str, float], acts: bool
) -> None:
    given = parameters(**safety)
    assert may_intervene(given) is acts
    loop = make_control_loop(given)
    assert (loop.watch is not None) is acts
    assert loop.supervision.authority.bounded is acts
    assert may_intervene(replace(given, ride_through=True))


@pytest.mark.parametrize("law", ["guided", "pd"])
def test_a_law_keeps_its_limits_or_is_cut_to_them_and_neither_where_nothing_supervises(law: str) -> None:
    given = replace(parameters(), law=law)
    made = {supervised: make_control_loop(given, supervised=supervised) for supervised in (False, True)}
    keeps = made[True].law.keeps_limits
    assert (made[True].supervision.authority.bounded, made[True].supervision.authority.clips) == (keeps, not keeps)
    assert (made[False].supervision.authority.bounded, made[False].supervision.authority.clips) == (False, False)


def test_the_law_of_the_safe_action_is_the_chosen_one() -> None:
    loop = make_control_loop(parameters(action="fallback", fallback_law="pd"), supervised=True)
    assert loop.fallback is not None
    assert (loop.law.name, loop.fallback._law.name) == ("guided", "pd")
    assert make_control_loop(parameters(fallback_law="pd"), supervised=True).fallback is None
