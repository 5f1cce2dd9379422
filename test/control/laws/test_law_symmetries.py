"""What holds for every law: its mirror image, other origins and turns of the earth-fixed frame, whole turns, a reset."""

import cmath
import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.laws import LAWS, make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

PERIOD, STEPS = 0.02, 12
# Centres around zero, so that the network of a ship and that of its mirror image are the same.
SYMMETRIC: dict[str, Any] = {"network.center": 0.0}
# Integrals that grow fast, and no saturation that hides them.
STRONG: dict[str, Any] = {"stretch": 1.0, "adaptation_gain": 0.3, "surge_force_limit": 1e9, "yaw_moment_limit": 1e12}
SETTINGS: dict[str, list[dict[str, Any]]] = {
    "hierarchical": [SYMMETRIC],
    "hierarchical_printed": [{**SYMMETRIC, "yaw_reaching_gain": 20.0, "surge_reaching_gain": 10.0, "yaw_adaptation_gain": 0.3}],
    "course": [{**SYMMETRIC, "reaching_gain": 20.0, "adaptation_gain": 0.3, "surge_force": 3e4}],
    "pd": [{"surge_force": 3e4}],
    "los_pid": [
        {},
        {**STRONG, "guidance": "alos"},
        {**STRONG, "integral_gain": 30.0},
        {"yaw_moment_limit": 3e5},
        {"surge_force_limit": 3e4},
    ],
    "ashrafiuon": [{}, {"surfaces": "as_printed"}],
    "backstepping": [{}, {"yaw_moment_limit": 3e5}],
    "hand_position": [{}, {"surge_force_limit": 3e4}],
    "guided": [{}],
    "nmpc": [{"steps": 2}],
}
CASES = [(law, settings) for law in SETTINGS for settings in SETTINGS[law]]
EARTH_FIXED = ("hierarchical_printed", "ashrafiuon")
"""Laws that take errors along the axes of the earth-fixed frame, or positions from its origin."""

Inputs = tuple[Motion, Motion, Acceleration]


def walk(seed: int, speed: float) -> list[Inputs]:
    """A reference at a speed and a ship beside it, both on a curve, under way past 180 degrees of heading."""
    random, found = np.random.default_rng(seed), []
    desired, ship = np.array([20.0, -7.0, 3.10, speed, 0.2, 0.11]), np.array([23.0, -3.0, 2.9, speed - 0.4, -0.1, 0.07])
    for _ in range(STEPS):
        change = random.uniform(-0.02, 0.02, 3)
        for state in (desired, ship):
            way = complex(state[3], state[4]) * cmath.exp(1j * state[2])
            state += PERIOD * np.array([way.real, way.imag, state[5], *change]) + random.normal(size=6) * 1e-3
        found.append((Motion(*ship.tolist()), Motion(*desired.tolist()), Acceleration(*change.tolist())))
    return found


def made(law: str, settings: dict[str, Any]) -> Any:
    if law == "nmpc":
        pytest.importorskip("casadi", reason="the predictive law is an extra")
    return make_controller(law, PERIOD, **settings)


def wrenches(law: Any, inputs: list[Inputs]) -> list[tuple[float, float]]:
    return [law.step(*each)[0] for each in inputs]


def agree(found: Any, expected: Any) -> None:
    """The same but for rounding, relative to the largest of each part."""
    largest = np.max(np.abs(expected), axis=0)
    np.testing.assert_allclose(found / largest, expected / largest, atol=2e-5)


@pytest.mark.parametrize("speed", [2.0, -2.0, 0.0])
@pytest.mark.parametrize(("law", "settings"), CASES)
def test_the_mirror_image_of_a_ship_gets_the_mirror_image_of_the_wrench(law: str, settings: Any, speed: float) -> None:
    def mirrored(m: Motion) -> Motion:
        return Motion(m.x, -m.y, -m.psi, m.u, -m.v, -m.r)

    inputs = walk(2, speed)
    reflected = [(mirrored(ship), mirrored(desired), Acceleration(a.du, -a.dv, -a.dr)) for ship, desired, a in inputs]
    # The excitation of `backstepping` has a side: it begins at zero.
    settings = {**settings, "excitation": 0.0} if law == "backstepping" else settings
    found, expected = wrenches(made(law, settings), reflected), wrenches(made(law, settings), inputs)
    agree(found, np.multiply(expected, [1.0, -1.0]))


@pytest.mark.parametrize("speed", [2.0, -2.0, 0.0])
@pytest.mark.parametrize(("law", "settings"), CASES)
def test_whole_turns_of_ship_or_reference_do_not_change_the_wrench(law: str, settings: Any, speed: float) -> None:
    inputs = walk(3, speed)
    turns = [2.0 * math.pi * k for k in (0, 1, -1, 1, 0, 0, 2, -1, 0, 1, 0, -1)]
    turned = [
        (ship._replace(psi=ship.psi + a), desired._replace(psi=desired.psi + b), change)
        for (ship, desired, change), a, b in zip(inputs, turns, reversed(turns), strict=True)
    ]
    agree(wrenches(made(law, settings), turned), np.array(wrenches(made(law, settings), inputs)))


@pytest.mark.parametrize("speed", [2.0, -2.0, 0.0])
@pytest.mark.parametrize(("law", "settings"), [case for case in CASES if case[0] not in EARTH_FIXED])
def test_the_wrench_does_not_depend_on_origin_and_axes_of_the_earth_fixed_frame(law: str, settings: Any, speed: float) -> None:
    angle, origin = 2.2, complex(310.0, -470.0)

    def moved(m: Motion) -> Motion:
        p = origin + complex(m.x, m.y) * cmath.exp(1j * angle)
        return m._replace(x=p.real, y=p.imag, psi=m.psi + angle)

    inputs = walk(4, speed)
    elsewhere = [(moved(ship), moved(desired), change) for ship, desired, change in inputs]
    agree(wrenches(made(law, settings), elsewhere), np.array(wrenches(made(law, settings), inputs)))


ENDS_ALIKE = ("hierarchical", "los_pid", "ashrafiuon", "guided", "nmpc")
"""Laws for which bow and stern are alike: those that control a point ahead of the origin, or errors from the origin, are not."""


@pytest.mark.parametrize("speed", [2.0, -2.0])
@pytest.mark.parametrize(("law", "settings"), [case for case in CASES if case[0] in ENDS_ALIKE])
def test_astern_a_ship_gets_the_opposite_force_and_the_same_moment_as_one_ahead_with_the_ends_exchanged(
    law: str, settings: Any, speed: float
) -> None:
    def exchanged(m: Motion) -> Motion:
        return Motion(m.x, m.y, m.psi + math.pi, -m.u, -m.v, m.r)

    inputs = walk(7, speed)
    others = [(exchanged(ship), exchanged(desired), Acceleration(-a.du, -a.dv, a.dr)) for ship, desired, a in inputs]
    agree(wrenches(made(law, settings), others), np.multiply(wrenches(made(law, settings), inputs), [-1.0, 1.0]))


@pytest.mark.parametrize("speed", [2.0, 0.0])
@pytest.mark.parametrize(("law", "settings"), CASES)
def test_a_law_that_ran_and_was_reset_is_bit_identical_to_a_new_one(law: str, settings: Any, speed: float) -> None:
    used, new, before, inputs = made(law, settings), made(law, settings), walk(5, -1.0), walk(6, speed)
    wrenches(used, before)
    used.reset()
    np.testing.assert_array_equal(wrenches(used, inputs), wrenches(new, inputs))


def test_every_tracking_law_is_in_these_tests() -> None:
    assert set(SETTINGS) == set(LAWS) - {"manoeuvre", "open_loop"}
