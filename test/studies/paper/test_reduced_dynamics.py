"""The motion that remains once heading and surge follow the reference, which (46) excludes: symbolically and in the code."""

import math
from typing import Any

import numpy as np
import paper_symbols as p
import pytest
import sympy as sp
from numpy.typing import NDArray

from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion, transform, transform_acceleration, transform_rate
from vessel_hsmc_ros.plant.dynamics import derivative, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

z2e, dz2e = sp.symbols("z2e dz2e", real=True)
tau_vw = p.DISTURBANCE[1]

# psi = psi_d and z1e = 0 at all times: the position error is purely lateral, and the surge velocity compensates for the rotation
# of that error.
FOLLOWING = {
    p.psi: p.psi_d,
    p.r: p.r_d,
    p.x: p.x_d - z2e * sp.sin(p.psi_d),
    p.y: p.y_d + z2e * sp.cos(p.psi_d),
    p.u: p.u_d - p.r_d * z2e,
    p.v: p.v_d + dz2e,
}
LINEAR = {p.d_v2: 0, p.d_v3: 0}
REDUCED = p.m11 / p.m22 * p.r_d**2 * z2e - p.d_v / p.m22 * dz2e + tau_vw


def sway_acceleration() -> Any:
    """ddz2e of two identical ships (6), (8) while heading and surge follow the reference, for the inputs that this takes."""
    ddz2e = p.rate(p.in_states(p.dz2e))
    (moment,) = sp.solve(p.RATES[p.r] - p.RATES[p.r_d], p.tau_2)  # dr = dr_d
    ddz2e = ddz2e.subs(p.tau_2, moment).subs({p.f_v: p.unforced(p.u, p.v, p.r)[1]}).subs(FOLLOWING)
    return ddz2e.subs({p.f_vd: p.unforced(p.u_d, p.v_d, p.r_d)[1]})


def test_the_substitution_keeps_heading_and_surge_on_their_references() -> None:
    for error, value in ((p.z1 - p.z1d, 0), (p.z2 - p.z2d, z2e), (p.dz1e, 0), (p.dz2e, dz2e), (p.dz3e, 0)):
        assert p.vanishes(p.in_states(error).subs(FOLLOWING) - value)


def test_sway_error_is_neutral_on_a_straight_line_and_unstable_in_every_turn() -> None:
    """ddz2e + (d_v/m22)·dz2e - (m11/m22)·r²·z2e = tau_vw: exact for linear sway damping, for any r(t) and any inputs."""
    assert p.vanishes(sway_acceleration().subs(LINEAR) - REDUCED)
    exponent = sp.Symbol("lambda")
    polynomial = exponent**2 - REDUCED.subs(tau_vw, 0).subs({dz2e: exponent, z2e: 1})
    slow, fast = sorted(sp.solve(polynomial.subs({p.m11: 2, p.m22: 3, p.d_v: 5, p.r_d: 1}), exponent))[::-1]
    assert fast < 0 < slow
    assert sp.solve(polynomial.subs(p.r_d, 0), exponent) == [0, -p.d_v / p.m22]


def test_higher_order_damping_adds_no_stiffness() -> None:
    """Its additional terms depend on v_d and dz2e only: there is no restoring force on the sway error."""
    added = sway_acceleration() - sway_acceleration().subs(LINEAR)
    assert p.vanishes(sp.diff(added, z2e))
    assert p.vanishes(added.subs(dz2e, 0))


@pytest.mark.parametrize("seed", range(20))
def test_plant_and_transformation_agree_with_the_reduced_dynamics(seed: int) -> None:
    """Plant, virtual ship and transformation at a random instant of such a motion, all damping terms included."""
    ship = VesselParameters().coefficients()
    random = np.random.default_rng(seed)
    reference = random.uniform(-1.0, 1.0, 6) * [100.0, 100.0, math.pi, 3.0, 1.0, 0.3]
    offset, drift, disturbance, force, moment = random.uniform(-1.0, 1.0, 5) * [20.0, 1.0, 0.05, 2e5, 3e6]
    normal = np.array([-math.sin(reference[2]), math.cos(reference[2])])
    state = reference.copy()
    state[:2] += offset * normal
    state[3:5] += [-reference[5] * offset, drift]

    d_acceleration = derivative(reference, (force, moment), (0.0, 0.0, 0.0), ship)[3:]
    acceleration = derivative(state, (0.0, 0.0), (0.0, disturbance, 0.0), ship)[3:]
    acceleration[2] = d_acceleration[2]  # by the yaw moment
    motion, desired = as_motion(state), as_motion(reference)
    z, z_d = transform(motion), transform(desired)
    ddz, ddz_d = (
        transform_acceleration(z, motion, as_acceleration(acceleration)),
        transform_acceleration(z_d, desired, as_acceleration(d_acceleration)),
    )
    assert transform_rate(z, motion).z1 == pytest.approx(transform_rate(z_d, desired).z1)
    assert transform_rate(z, motion).z2 - transform_rate(z_d, desired).z2 == pytest.approx(drift)

    turn = ship.m11 / ship.m22 * reference[5] ** 2 * offset
    damping = unforced_acceleration(0.0, state[4], 0.0, ship)[1] - unforced_acceleration(0.0, reference[4], 0.0, ship)[1]
    assert ddz.z2 - ddz_d.z2 == pytest.approx(turn + damping + disturbance, abs=1e-9)


def straight_line_matrix() -> tuple[Any, Any]:
    """Linearised motion on S1 = S2 = 0 about a straight reference at speed u_d, x_d from the origin.

    Returns:
        The system matrix of heading error, sway error and sway velocity, and the yaw rate.
    """
    small, heading, sway, drift = sp.symbols("small heading sway drift", real=True)
    turning = sp.Symbol("turning", real=True)
    near = {p.psi: small * heading, p.r: small * turning, p.x: p.x_d, p.y: small * sway, p.u: p.u_d, p.v: small * drift}
    straight = {p.psi_d: 0, p.y_d: 0, p.v_d: 0, p.r_d: 0}

    def linear(expression: Any) -> Any:
        return sp.expand(sp.diff(expression.subs(near).subs(straight), small).subs(small, 0).doit())

    (turning_rate,) = sp.solve(linear(p.in_states(p.YAW_SURFACE)), turning)
    dv = linear(p.unforced(p.u, p.v, p.r)[1].subs({**LINEAR}))
    rates = [turning_rate, linear(p.RATES[p.y]), dv.subs(turning, turning_rate)]
    return sp.Matrix([[sp.diff(rate, q) for q in (heading, sway, drift)] for rate in rates]), turning_rate


def test_on_a_straight_line_the_restoring_rate_is_proportional_to_a_over_b() -> None:
    """Near the origin det = -(a/b)·c1·u_d·d_v/m22, so the slow root is -(a/b)·(c1/c2)·u_d to first order in a."""
    matrix, _ = straight_line_matrix()
    matrix = matrix.subs(p.x_d, 0)
    expected = -(p.a / p.b) * p.c1 * p.u_d * p.d_v / p.m22
    assert sp.simplify(matrix.det() - expected) == 0
    others = matrix.subs(p.a, 0).charpoly().as_expr().subs(sp.Symbol("lambda"), 0)
    assert others == 0  # marginally stable for a = 0
    paper = {p.a: 0.001, p.b: 100, p.c1: 0.3, p.c2: 0.3, p.u_d: 2.3215, p.m11: 120e3, p.m22: 177.9e3, p.d_v: 147e3}
    slow = max(np.linalg.eigvals(np.array(matrix.subs(paper), dtype=float)).real)
    assert slow == pytest.approx(-2.3215e-5, rel=1e-3)  # 1/s: the error halves in eight hours


def test_the_restoring_effect_changes_sign_beyond_z1_of_b_over_a() -> None:
    """The yaw rate has one pole, at the singularity of the law."""
    _, turning_rate = straight_line_matrix()
    assert sp.solve(sp.denom(sp.together(turning_rate)), p.x_d) == [p.b / p.a]


ON_THE_CIRCLE = (2.2566, -0.2195, 0.12495)  # u, v, r of the reference of case 2 in the steady turn


def sway_errors(offset: float) -> NDArray[np.float64]:
    """z2e of case 2 in calm water over 30 s, both ships on the circle with a lateral offset, m."""
    u, v, r = ON_THE_CIRCLE
    changes: dict[str, object] = {
        f"vessel_sim.disturbance.periodic.{axis}": 0.0 for axis in ("surge_force", "sway_force", "yaw_moment")
    }
    changes |= {"reference_ship.initial_pose": (0.0, -18.0, 0.0), "reference_ship.initial_velocity": ON_THE_CIRCLE}
    changes |= {"vessel_sim.initial_pose": (0.0, -18.0 + offset, 0.0), "vessel_sim.initial_velocity": (u - r * offset, v, r)}
    run = simulate(load_scenario("case2_tracking", {**changes, "vessel_sim.duration": 30.0}))
    return np.array(run.control["sway_error"])


def test_two_runs_of_case_2_diverge_at_the_rate_of_the_reduced_dynamics() -> None:
    """The closed loop with the printed gains: a sway error doubles every minute.

    With a finite k2, f_u, which changes with u_e = -r·z2e, leaves an error z1e = e·z2e with e = -(df_u/du)·r/(k2·c3);
    inserted into the derivation above, it reduces the destabilising term of the turn by (d_v/m22)·e·r.
    """
    ship, g = VesselParameters().coefficients(), HierarchicalPrintedParameters()
    u, v, r = ON_THE_CIRCLE
    damping = (ship.d_v + 2.0 * ship.d_v2 * abs(v) + 3.0 * ship.d_v3 * v * v) / ship.m22
    drag = (ship.d_u + 2.0 * ship.d_u2 * u + 3.0 * ship.d_u3 * u * u) / ship.m11
    mass = ship.m11 / ship.m22
    e = drag * r / (g.surge_reaching_gain * g.surge_surface_slope)
    predicted = max(np.roots([1.0, damping, -mass * r * r]))
    corrected = max(np.roots([1.0, damping + e * r * (1.0 + mass), -(mass * r * r - damping * e * r)]))

    difference = sway_errors(0.01) - sway_errors(-0.01)
    growth = math.log(difference[-1] / difference[1000]) / 20.0
    assert predicted == pytest.approx(0.01142, abs=1e-5)
    assert growth == pytest.approx(predicted, rel=0.03)
    assert growth == pytest.approx(corrected, rel=0.005)
