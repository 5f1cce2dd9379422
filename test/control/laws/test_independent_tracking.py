"""The tracking laws against doubles and against the equations of their descriptions, where all numbers differ."""

import cmath
import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from independent_tracking import Backstepping, HandPosition, LineOfSight, errors, free, limited, wrapped

from vessel_hsmc_ros.control.interface.known_vessel import KnownDamping, KnownVessel
from vessel_hsmc_ros.control.laws import LAWS, construct
from vessel_hsmc_ros.control.laws.los_pid import LosPidParameters, scaled, stretched
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.schema import entries

PERIOD = 0.05
STILL = Acceleration(0.0, 0.0, 0.0)
DAMPING = KnownDamping(
    surge_damping=2.1e4,
    sway_damping=1.4e5,
    yaw_damping=8.3e6,
    surge_damping_quadratic=5e3,
    surge_damping_cubic=1.7e3,
    sway_damping_quadratic=3.1e4,
    sway_damping_cubic=1.3e4,
    yaw_damping_quadratic=1.9e6,
    yaw_damping_cubic=9e5,
)


def random_parameters(law: str, random: Any, **fixed: Any) -> Any:
    """Gains that all differ, around the default ones."""
    cls = LAWS[law].parameters
    numbers = {f.name: getattr(cls(), f.name) for f in dataclasses.fields(cls) if isinstance(getattr(cls(), f.name), float)}
    drawn = {name: value * float(random.uniform(0.6, 1.7)) for name, value in numbers.items()}
    return cls(**{**drawn, **({"model": DAMPING} if law != "los_pid" else {}), **fixed})


def random_vessel(random: Any, share: float) -> KnownVessel:
    """Inertias and limits that all differ; the limits are `share` of a typical demand."""
    m11, m22, m33 = (value * float(random.uniform(0.8, 1.2)) for value in (120e3, 177.9e3, 636e5))
    limits: Any = {"surge_force_limit": share * 2.1e5, "yaw_moment_limit": share * 3.3e6}
    return KnownVessel(surge_inertia=m11, sway_inertia=m22, yaw_inertia=m33, **limits)


def random_inputs(random: Any, steps: int, moving: bool = True, far: float = 8.0) -> list[tuple[Motion, Motion, Acceleration]]:
    """Ship and reference near each other, ahead and astern, across 180 degrees."""
    found = []
    for _ in range(steps):
        desired = random.uniform(-1.0, 1.0, 6) * [90.0, 90.0, math.pi, 3.0, 0.8, 0.2] * [1, 1, 1, moving, moving, moving]
        ship = desired + random.uniform(-1.0, 1.0, 6) * [far, far, math.pi, 2.0, 0.6, 0.2]
        change = random.uniform(-1.0, 1.0, 3) * [0.3, 0.1, 0.02]
        found.append((Motion(*ship.tolist()), Motion(*desired.tolist()), Acceleration(*change.tolist())))
    return found


def agree(law: Any, double: Any, inputs: list[tuple[Motion, Motion, Acceleration]]) -> set[tuple[bool, bool]]:
    """Compare each step, and return which limits were met."""
    seen = set()
    for ship, desired, change in inputs:
        wrench, terms = law.step(ship, desired, change)
        expected = double.step(ship, desired, change)
        assert wrench == pytest.approx(expected.wrench, rel=1e-9)
        assert (terms.surge_saturated, terms.yaw_saturated) == expected.saturated
        assert (terms.surge_error, terms.sway_error, terms.heading_error) == pytest.approx(errors(ship, desired), abs=1e-9)
        commanded = terms.commanded_heading, terms.commanded_yaw_rate, terms.commanded_surge_velocity
        assert commanded == pytest.approx((expected.heading, expected.yaw_rate, expected.speed), rel=1e-9, nan_ok=True)
        seen.add(expected.saturated)
    return seen


@pytest.mark.parametrize("guidance", ["ilos", "alos"])
@pytest.mark.parametrize("moving", [True, False])
def test_line_of_sight_and_pid_agree_with_their_double(guidance: str, moving: bool) -> None:
    seen, random = set(), np.random.default_rng(4)
    for share in (0.2, 1.0, 5.0, 1e3):
        for _ in range(4):
            gains = random_parameters("los_pid", random, guidance=guidance, stretch=1.0, capture_radius=3.0)
            gains = dataclasses.replace(gains, adaptation_gain=0.5) if guidance == "alos" else gains  # to meet its bound
            vessel = random_vessel(random, share)
            inputs = random_inputs(random, 12, moving)
            # At one place in the middle: the integrals grow, with ships on both sides of the reference.
            inputs[5:9] = [inputs[5]] * 4
            seen |= agree(construct("los_pid", gains, vessel, PERIOD), LineOfSight(gains, vessel, PERIOD), inputs)
    assert {(False, False), (False, True), (True, True)} <= seen


def test_adaptive_guidance_stops_at_both_bounds_and_leaves_them_again() -> None:
    gains, vessel = LosPidParameters(guidance="alos", adaptation_gain=0.8, stretch=1.0), KnownVessel()
    for side in (1.0, -1.0):
        law: Any = construct("los_pid", gains, vessel, PERIOD)
        desired = Motion(3.0, -2.0, 0.4, 2.0, 0.0, 0.0)
        at = [desired._replace(x=desired.x - y * math.sin(0.4), y=desired.y + y * math.cos(0.4)) for y in (side, -side)]
        for _ in range(80):
            law.step(at[0], desired, STILL)
        bound = law.memory.integral
        assert 0.5 <= side * bound < 0.55
        law.step(at[1], desired, STILL)
        assert side * law.memory.integral < side * bound


def test_the_hand_position_agrees_with_its_double() -> None:
    seen, random = set(), np.random.default_rng(5)
    for share, far in ((1e3, 8.0), (1e3, 60.0), (1.0, 3.0), (2.0, 8.0)):
        for _ in range(4):
            gains, vessel = random_parameters("hand_position", random), random_vessel(random, share)
            law, double = construct("hand_position", gains, vessel, PERIOD), HandPosition(gains, vessel, PERIOD)
            seen |= agree(law, double, random_inputs(random, 10, far=far))
    assert len(seen) == 4


def moved(ship: Motion, change: Acceleration, t: float) -> Motion:
    """A ship a time later, to the second order."""
    at, r = cmath.exp(1j * ship.psi), ship.r
    velocity = complex(ship.u, ship.v)
    way = at * (velocity * t + 0.5 * t * t * (complex(change.du, change.dv) + 1j * r * velocity))
    return Motion(
        ship.x + way.real,
        ship.y + way.imag,
        ship.psi + t * r + 0.5 * t * t * change.dr,
        ship.u + t * change.du,
        ship.v + t * change.dv,
        r + t * change.dr,
    )


def forced(ship: Motion, wrench: tuple[float, float], vessel: KnownVessel) -> Acceleration:
    f = free(ship, vessel, DAMPING)
    return Acceleration(f.du + wrench[0] / vessel.surge_inertia, f.dv, f.dr + wrench[1] / vessel.yaw_inertia)


@pytest.mark.parametrize("seed", range(25))
def test_backstepping_commands_the_yaw_rate_at_which_its_error_decays_and_follows_it(seed: int) -> None:
    """dz_e = -k2·z_e with z_e = psi_e + asin(k·y_e/W) for a ship that has the yaw rate alpha_r."""
    random = np.random.default_rng(seed)
    # Also with filters that are faster than the period.
    fast = {"filter_time": 0.01} if seed % 3 == 0 else {}
    p, vessel = random_parameters("backstepping", random, **fast), random_vessel(random, 20.0 if seed % 2 else 1.5)
    law, double, phase = construct("backstepping", p, vessel, PERIOD), Backstepping(p, vessel, PERIOD), 0.0

    def error(ship: Motion, desired: Motion, now: float) -> float:
        e = complex(ship.x - desired.x, ship.y - desired.y) * cmath.exp(-1j * ship.psi)
        k = p.speed_weight * (desired.u**2 + (desired.r * p.error_scale) ** 2) + p.excitation * math.sin(now)
        ratio = limited(k, 0.9) * e.imag / math.sqrt(p.error_scale**2 + abs(e) ** 2)
        return wrapped(ship.psi - desired.psi) + math.asin(ratio)

    for ship, desired, change in random_inputs(random, 6):
        (tau_1, tau_2), terms = law.step(ship, desired, change)
        virtual = terms.commanded_surge_velocity, terms.commanded_yaw_rate
        x_e = (complex(ship.x - desired.x, ship.y - desired.y) * cmath.exp(-1j * ship.psi)).real
        w = complex(desired.u, desired.v) * cmath.exp(1j * (desired.psi - ship.psi))
        assert virtual[0] == pytest.approx(w.real - p.along_gain * x_e / math.hypot(1.0, x_e / p.along_scale), rel=1e-9)
        turning, h = ship._replace(r=virtual[1]), 1e-5
        z = [error(moved(turning, STILL, t), moved(desired, change, t), phase + t * p.excitation_frequency) for t in (-h, 0.0, h)]
        if abs(z[1]) < math.pi - 0.1:
            assert (z[2] - z[0]) / (2.0 * h) == pytest.approx(-p.heading_gain * z[1], rel=1e-4, abs=1e-5)
        expected = double.step(ship, virtual)
        assert (tau_1, tau_2) == pytest.approx(expected.wrench, rel=1e-9)
        assert (terms.surge_saturated, terms.yaw_saturated) == expected.saturated
        phase += PERIOD * p.excitation_frequency


def test_backstepping_turns_towards_the_course_to_a_reference_across_180_degrees() -> None:
    p, vessel = random_parameters("backstepping", np.random.default_rng(3)), random_vessel(np.random.default_rng(3), 1e3)
    desired = Motion(0.0, 0.0, 3.0, 0.5, 0.0, 0.0)
    found = []
    for turns in (0.0, 2.0 * math.pi):
        ship = Motion(4.0, 9.0, 3.1 - turns, 0.5, 0.0, 0.0)
        found.append(construct("backstepping", p, vessel, PERIOD).step(ship, desired, STILL)[0])
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def sliding(ship: Motion, desired: Motion, change: Acceleration, p: Any, vessel: KnownVessel) -> tuple[complex, float, complex]:
    """e_u + i·e_v, de_v, and the demanded velocity in the ship's frame, of `ashrafiuon`."""
    k = p.position_gain if p.surfaces == "position" else 0.0

    def demanded(t: float) -> complex:
        a, b = moved(ship, free(ship, vessel, DAMPING), t), moved(desired, change, t)
        e = complex(a.x - b.x, a.y - b.y)
        pulled = complex(math.tanh(e.real / p.position_scale), math.tanh(e.imag / p.position_scale))
        return complex(b.u, b.v) * cmath.exp(1j * b.psi) - k * p.position_scale * pulled

    h, at = 1e-4, cmath.exp(-1j * ship.psi)
    c, dc = demanded(0.0), (demanded(h) - demanded(-h)) / (2.0 * h)
    body, f = complex(ship.u, ship.v), free(ship, vessel, DAMPING)
    # In the turning frame: d(R'c) = R'dc - i·r·R'c.
    rate = complex(f.du, f.dv) - (dc * at - 1j * ship.r * c * at)
    return body - c * at, rate.imag, c * at


@pytest.mark.parametrize("surfaces", ["position", "as_printed"])
@pytest.mark.parametrize("seed", range(12))
def test_both_surfaces_obey_their_reaching_laws(seed: int, surfaces: str) -> None:
    """dS1 = -k1·sat(S1/phi1) and dS2 = -k2·sat(S2/phi2), inside of the boundary layers and outside."""
    random = np.random.default_rng(seed)
    wide = {"surge_boundary": 0.9, "sway_boundary": 1.3} if seed % 2 else {}
    p, vessel = random_parameters("ashrafiuon", random, surfaces=surfaces, **wide), random_vessel(random, 1e4)
    law: Any = construct("ashrafiuon", p, vessel, PERIOD)
    printed, l1, l2 = surfaces == "as_printed", p.surge_slope, p.sway_slope
    I_u = I_v = 0.0
    checked = 0
    for ship, desired, change in random_inputs(random, 8):
        wrench, terms = law.step(ship, desired, change)
        own, h = forced(ship, wrench, vessel), 1e-4
        S = []
        for t in (-h, 0.0, h):
            # The reference's acceleration is constant in its frame.
            e, de_v, c = sliding(moved(ship, own, t), moved(desired, change, t), change, p, vessel)
            turns = (I_u + t * e.real, I_v + t * e.imag) if printed else (0.0, 0.0)
            S.append((e.real + l1 * turns[0], de_v + 2.0 * l2 * e.imag + l2 * l2 * turns[1], c, e))
        reaching = [
            -k * limited(s / phi, 1.0)
            for k, s, phi in ((p.surge_gain, S[1][0], p.surge_boundary), (p.sway_gain, S[1][1], p.sway_boundary))
        ]
        rates = [(S[2][i] - S[0][i]) / (2.0 * h) for i in range(2)]
        assert terms.surge_surface == pytest.approx(S[1][0], rel=1e-6, abs=1e-6)
        assert terms.commanded_surge_velocity == pytest.approx(S[1][2].real, rel=1e-9)
        assert rates[0] == pytest.approx(reaching[0], abs=2e-4)
        b = S[1][2].real - vessel.surge_inertia / vessel.sway_inertia * ship.u
        if abs(b) > p.least_control_gain:
            assert rates[1] == pytest.approx(reaching[1], abs=5e-3)
            checked += 1
        if printed:
            I_u, I_v = I_u + PERIOD * S[1][3].real, I_v + PERIOD * S[1][3].imag
    assert checked >= 3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_near_its_singularity_the_law_of_two_surfaces_keeps_the_sign_of_its_gain(side: float) -> None:
    p, vessel = random_parameters("ashrafiuon", np.random.default_rng(1)), KnownVessel(yaw_moment_limit=1e12)
    desired = Motion(0.0, 0.0, 0.0, 2.0, 0.0, 0.0)
    mu = vessel.surge_inertia / vessel.sway_inertia

    def moment(b: float) -> float:
        ship = Motion(0.0, 0.05, 0.0, (2.0 - b) / mu, 0.1, 0.0)
        return construct("ashrafiuon", p, vessel, PERIOD).step(ship, desired, STILL)[0][1]

    near, edge = (moment(side * share * p.least_control_gain) for share in (0.9, 1.0001))
    assert near * edge > 0.0
    assert near == pytest.approx(edge, rel=0.2)


@pytest.mark.parametrize("saturated", ["surge", "yaw"])
def test_an_integral_of_the_law_as_printed_stops_while_its_own_actuator_is_saturated(saturated: str) -> None:
    limits: Any = {"surge_force_limit": 1e12, "yaw_moment_limit": 1e12}
    limits["surge_force_limit" if saturated == "surge" else "yaw_moment_limit"] = 1.0
    law: Any = construct("ashrafiuon", LAWS["ashrafiuon"].parameters(surfaces="as_printed"), KnownVessel(**limits), PERIOD)
    law.step(Motion(0.0, 0.0, 0.3, 1.0, 0.2, 0.05), Motion(0.0, 0.0, 0.0, 2.0, 0.1, 0.01), STILL)
    integrals = {"surge": law.memory.surge_integral, "yaw": law.memory.sway_integral}
    assert {name for name, value in integrals.items() if value == 0.0} == {saturated}


DIMENSIONS = {"": (0, 0), "s": (0, 1), "m": (1, 0), "m/s": (1, -1), "1/s": (0, -1), "1/s²": (0, -2), "1/s³": (0, -3)}
DIMENSIONS |= {"rad/s": (0, -1), "1/(m·s)": (-1, -1)}


def test_every_gain_of_a_similar_ship_scales_by_its_unit() -> None:
    p = LosPidParameters()
    found = scaled(p, 3.0, 1.7)
    for name, entry in entries(LosPidParameters).items():
        if name not in ("guidance", "stretch"):
            length, time = DIMENSIONS[entry.unit]
            assert getattr(found, name) == pytest.approx(getattr(p, name) * 3.0**length * 1.7**time), name


def test_stretched_gains_are_slower_by_the_factor_and_keep_lengths_and_speeds_of_the_ship() -> None:
    """Times longer by q: a gain per time is divided by q, one per time squared by q²; the lookahead distance grows with q."""
    p, q = LosPidParameters(), 1.7
    powers = {
        "lookahead_time": 1,
        "lookahead_distance": 1,
        "adaptation_gain": -2,
        "along_gain": -1,
        "surge_gain": -1,
        "surge_integral_gain": -2,
        "yaw_bandwidth": -1,
        "yaw_integral_gain": -3,
        "command_bandwidth": -1,
    }
    found = stretched(p, q)
    for field in dataclasses.fields(p):
        value = getattr(p, field.name)
        if field.name in powers:
            assert getattr(found, field.name) == pytest.approx(value * q ** powers[field.name]), field.name
        else:
            assert getattr(found, field.name) == value, field.name


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_backstepping_turns_on_where_the_course_to_the_reference_is_beyond_180_degrees(side: float) -> None:
    law = construct("backstepping", LAWS["backstepping"].parameters(excitation=0.0), KnownVessel(), PERIOD)
    desired = Motion(0.0, 0.0, 0.0, 1.6, 0.0, 0.0)
    ship = Motion(-9.0 * math.sin(3.1), side * 9.0 * math.cos(3.1), side * 3.1, 1.0, 0.0, 0.0)
    assert side * law.step(ship, desired, STILL)[1].commanded_yaw_rate > 0.0
