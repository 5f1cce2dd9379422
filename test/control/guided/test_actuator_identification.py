"""The identification of the actuators by a bank of models."""

import math
from typing import Any

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from ship_family import ShipFamily, expand

from vessel_hsmc_ros.control.guided.controller import LONGEST_AGE, GuidedController
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.interface.actuators import (
    ASSUMED_LAG,
    BEST,
    Bank,
    bank,
    first_state,
    grid,
    identify,
    unit_time,
    with_model,
)
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, make_law
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.simulation.offline import simulate

UNDECLARED = KnownVessel()
T = unit_time(UNDECLARED)
PERIOD = 0.05


def declared(lag: float, dead_time: float, full: float) -> KnownVessel:
    """A vessel that declares the same delays of both inputs, in units of T."""
    numbers: dict[str, Any] = {"lag": lag * T, "dead_time": dead_time * T}
    values = {f"{axis}_{name}": value for axis in ("surge", "yaw") for name, value in numbers.items()}
    rate = 1.0 / (full * T) if full else math.inf
    return KnownVessel(**values, surge_force_rate=2e5 * rate, yaw_moment_rate=3e6 * rate)


def model_after(
    c: Bank,
    lag: float,
    dead_time: float,
    full: float,
    duration: float = 40.0,
    damping: float = 0.6,
    late: int = 0,
    size: float = 0.6,
) -> int:
    """The best model for a hull that turns by these actuators, all in units of T, and for headings that are `late` periods old.

    The command changes at random every 0.8 T. The heading passes 180 degrees many times: the hull turns to port on the whole.
    """
    m, rng, identified_by = first_state(c, 2.0), np.random.default_rng(4), compiled(identify)
    commands, headings, psi, r, tau = [0.0] * (1 + round(dead_time * T / PERIOD)), [3.0] * (late + 1), 3.0, 0.0, 0.0
    command, limit = 0.0, UNDECLARED.yaw_moment_limit
    for k in range(round(duration * T / PERIOD)):
        if k % round(0.8 * T / PERIOD) == 0:
            command = size * limit * float(rng.uniform(-1.0, 1.2))
        identified_by(m, c, headings[0], late * PERIOD, command)
        commands = [*commands[1:], command]
        share = -math.expm1(-PERIOD / (lag * T)) if lag else 1.0
        change = limit * PERIOD / (full * T) if full else math.inf
        tau += min(max(share * (commands[0] - tau), -change), change)
        r += PERIOD * (tau / UNDECLARED.yaw_inertia - damping / T * r)
        psi = math.remainder(psi + PERIOD * r, 2.0 * math.pi)
        headings = [*headings[1:], psi]
    return int(m.numbers[BEST])


ACTUATORS = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.3, 0.0), (0.15, 0.14, 1.8), (0.0, 0.06, 2.6)]


@pytest.mark.parametrize(("lag", "dead_time", "full"), rest_long(ACTUATORS, 4))
def test_actuators_that_are_not_declared_are_found(lag: float, dead_time: float, full: float) -> None:
    number = model_after(bank(UNDECLARED, PERIOD), lag, dead_time, full)
    found = grid()[number - 1]
    assert number > 0
    assert found[0] + found[1] == pytest.approx(lag + dead_time, abs=0.11)
    assert found[2] == pytest.approx(full, abs=0.7)


def test_a_wide_turn_at_the_start_shows_instant_actuators_at_once() -> None:
    """What was commanded before the first turn was measured has no answer yet; it is no dead time."""
    number = model_after(bank(UNDECLARED, PERIOD, soon=True), 0.0, 0.0, 0.0, duration=1.0)
    assert grid()[number - 1] == (0.0, 0.0, 0.0)
    assert number > 0


def test_a_guess_that_is_right_gives_way_to_a_model_as_good() -> None:
    """The law is slower as long as its actuators are a guess."""
    number = model_after(bank(UNDECLARED, PERIOD, soon=True), ASSUMED_LAG, 0.0, 0.0)
    assert number > 0
    assert sum(grid()[number - 1][:2]) == pytest.approx(ASSUMED_LAG, abs=0.11)


@pytest.mark.parametrize(("lag", "dead_time", "full"), ACTUATORS)
def test_what_is_declared_rightly_stays(lag: float, dead_time: float, full: float) -> None:
    damping = (0.2, 1.5)[ACTUATORS.index((lag, dead_time, full)) % 2]
    c = bank(declared(lag, dead_time, full), PERIOD)
    assert model_after(c, lag, dead_time, full, damping=damping) == 0


def test_the_age_of_a_measurement_is_no_dead_time() -> None:
    late = round(0.4 * T / PERIOD)
    assert model_after(bank(declared(0.0, 0.06, 0.0), PERIOD), 0.0, 0.06, 0.0, late=late) == 0
    assert model_after(bank(declared(0.0, 0.06, 0.0), PERIOD), 0.0, 0.5, 0.0, late=late) > 0


@pytest.mark.parametrize("late", rest_long([4, 11]))
def test_an_age_that_is_no_whole_number_of_intervals_counts_as_the_nearest_one(late: int) -> None:
    c = bank(declared(0.0, 0.06, 0.0), PERIOD)
    assert c.every == 5
    whole = 5 * round(late / 5)
    found = [model_after(c, 0.0, 0.4, 0.3, late=periods) for periods in (late, whole)]
    assert found[0] == found[1] > 0


def test_a_ship_that_hardly_turns_shows_nothing() -> None:
    assert model_after(bank(UNDECLARED, PERIOD), 0.0, 0.25, 1.2, size=0.001) == 0


def test_a_model_takes_the_place_of_all_delays_of_both_inputs() -> None:
    vessel = declared(0.5, 0.5, 0.5)
    assert with_model(vessel, 0) is vessel
    for number, (lag, dead_time, full) in enumerate(grid(), 1):
        expected = vars(declared(lag, dead_time, full))
        for name, value in vars(with_model(vessel, number)).items():
            assert value == (expected[name] if isinstance(value, str) else pytest.approx(expected[name]))


def test_new_gains_keep_what_was_identified_and_each_reset_forgets_it() -> None:
    law = GuidedController(GuidedParameters(), UNDECLARED, PERIOD)
    for number in (40, 41):
        law.memory.bank.numbers[BEST] = number
        law.memory.bank.models[number, 0] = 0.003
        law.renew()
        assert law.memory.tau_2 * law.constants.gains.moment == pytest.approx(0.003 * UNDECLARED.yaw_inertia)
        assert law.known == with_model(UNDECLARED, number) != UNDECLARED
        for parameters in (GuidedParameters(position_gain=2.0), GuidedParameters(actuator_identification=False)):
            law.retune(parameters)
            assert law.known == with_model(UNDECLARED, number)
            assert not law.outdated(law.memory, law.constants)
            assert (law.constants.bank.every > 0) is parameters.actuator_identification
        law.retune(GuidedParameters())
        law.reset()
        assert law.known is law.vessel
        assert law.memory.bank.numbers[BEST] == law.constants.bank.used == 0


@pytest.mark.parametrize("age", [2.0 + PERIOD, 60.0])
def test_a_measurement_older_than_the_longest_age_counts_as_that_old(age: float) -> None:
    laws = [GuidedController(GuidedParameters(), UNDECLARED, PERIOD) for _ in range(2)]
    desired, still = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0)
    for k in range(100):
        ship = Motion(0.0, math.sin(0.3 * k), 0.02 * k, 1.0, 0.0, 0.1 * math.cos(0.2 * k))
        first, other = (law.step(ship, desired, still, given) for law, given in zip(laws, (LONGEST_AGE, age), strict=True))
        assert first[0] == other[0]
    np.testing.assert_array_equal(laws[0].memory.bank.models, laws[1].memory.bank.models)


def stranger(**changes: object) -> Scenario:
    """A ship of which nothing is declared, with a large dead time and a slow rate."""
    family = ShipFamily(
        length=90.0, has_dead_time=True, dead_time=0.28, has_rate=True, time_to_full=1.0, reference="circle", knowledge="nothing",
        speed=0.5, control_rate_hz=10.0,
    )  # fmt: skip
    return load_scenario("case2_tracking", {"controller.law": "guided", **expand(family), **changes})


def rms_error(scenario: Scenario) -> float:
    """The rms position error of the last quarter, in lengths."""
    run = simulate(scenario)
    errors = (run.state - run.reference)[3 * len(run.time) // 4 :, :2]
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1)))) / scenario.controller.vessel.length


@only_compiled
def test_a_ship_whose_large_dead_time_is_not_declared_is_accurate_because_it_is_identified() -> None:
    assert rms_error(stranger()) < 0.002
    assert not rms_error(stranger(**{"controller.guided.actuator_identification": False})) < 0.01


@pytest.mark.parametrize("observed", rest_long([False, True]))
def test_a_run_in_which_the_model_changes_is_the_same_compiled_and_interpreted(observed: bool) -> None:
    scenario = stranger(**{"vessel_sim.duration": 60.0, "controller.observer.enabled": observed})
    law = make_law(scenario.controller)
    compiled = simulate(scenario, law=law)
    assert law.known is not law.vessel
    np.testing.assert_array_equal(simulate(scenario, interpreted=True).state, compiled.state)


def test_a_reset_forgets_what_was_identified() -> None:
    scenario = stranger(**{"vessel_sim.duration": 60.0})
    law = make_law(scenario.controller)
    first = simulate(scenario, law=law).state
    law.reset()
    assert law.known is law.vessel
    np.testing.assert_array_equal(simulate(scenario, law=law).state, first)
