"""The loops of the guided law linearised about a straight path, period by period as the law computes.

| symbol | meaning | unit |
|---|---|---|
| U | speed along the straight path | m/s |
| x, y, psi, u, v, r | deviations along and across the path, of the heading and of the velocities | m, rad, m/s, rad/s |
| a | force or moment divided by the inertia that the law knows | m/s², rad/s² |
| Z_u, A_vr | hull about the straight path: du = Z_u·u + g_u·a, (dv, dr) = A_vr·(v, r) + g_vr·a | 1/s |

Lag, dead time, lead, prediction, networks (which count as integrators of the innovation), command filter and integrals are in the
loops, which `linear_loop` evaluates. Limits of magnitude and rate are not linear, and not in them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.guided.parameters import Gains
from vessel_hsmc_ros.law.applied_wrench import Channel
from vessel_hsmc_ros.law.linear_loop import Form, Forms, System, exact_step, queue_names

Array = NDArray[np.float64]


class Carriage(NamedTuple):
    """How the reference is carried to the point that the law controls, with delta_f' = omega·(psi - delta_f) + b.

    Attributes:
        ahead: Distance of the point ahead of the origin, m.
        omega, q: Gains of the filter of the headings, 1/s, 1/s²; b' = q·(psi - delta_f).
    """

    ahead: float
    omega: float
    q: float


class Hull(NamedTuple):
    """A hull about a straight path, at the point that the law controls.

    Attributes:
        speed: U, m/s.
        surge: Z_u, 1/s.
        surge_gain: g_u, the inertia that the law knows divided by the true one.
        lateral: A_vr, shape (2, 2).
        lateral_gain: g_vr, shape (2,): zero and one for a law that knows inertia and pivot.
        carriage: None where the point is the origin.
    """

    speed: float
    surge: float
    surge_gain: float
    lateral: Array
    lateral_gain: Array
    carriage: Carriage | None = None


class Actuator(NamedTuple):
    """The true lag and dead time of an input, s."""

    lag: float
    dead_time: float


def add_plant(forms: Forms, states: list[str], motion: tuple[Array, Array], actuator: Actuator, received: Form, T: float) -> None:
    """Add the next true state to the forms: dead time, lag and motion.

    Args:
        forms: The forms of the period, with the queue `sent` and the state `a`.
        states: Names of the states of the motion.
        motion: A and B of the motion in continuous time, driven by a.
        actuator: True lag and dead time.
        received: What the actuator receives.
        T: Control period, s.
    """
    arrived = forms.queue("sent", received)[-1]
    A, B = motion
    if actuator.lag == 0.0:
        step, drive = exact_step(A, B, T)
        rows = [forms.now[name] for name in states]
        forms.next["a"] = arrived
    else:
        grown = np.block([[A, B[:, None]], [np.zeros((1, len(A))), np.array([[-1.0 / actuator.lag]])]])
        step, drive = exact_step(grown, np.append(np.zeros(len(A)), 1.0 / actuator.lag), T)
        states = [*states, "a"]
        rows = [forms.now[name] for name in states]
    for name, row, gain in zip(states, step, drive, strict=True):
        forms.next[name] = sum(factor * form for factor, form in zip(row, rows, strict=True)) + gain * arrived


def wrench_ahead(forms: Forms, c: Channel, n: int) -> list[Form]:
    """The modelled inputs of the last period and of the n next ones, from the commands on their way; as `guided_delays.ahead`.

    Args:
        forms: The forms of the period, with the state `model` and the queue `command`.
        c: The input as the law knows it.
        n: Delay of the slower input in periods.
    """
    a = [forms.now["model"]]
    for i in range(n):
        sent = forms.now[f"command {max(c.delay - i, 1) - 1}"]
        a.append(a[-1] + c.share * (sent - a[-1]))
    return a


def command_of(forms: Forms, demand: Form, acting: Form, c: Channel) -> Form:
    """The command by the lead, and the model's next input; as `applied_wrench`."""
    command = acting + c.boost * (demand - acting)
    arriving = forms.queue("command", command)[c.delay]
    forms.next["model"] = forms.now["model"] + c.share * (arriving - forms.now["model"])
    return command


def names_of(states: list[str], law: list[str], c: Channel, actuator: Actuator, T: float) -> list[str]:
    """The names of all states of a loop: the true ones, those of the law, and both queues."""
    late = round(actuator.dead_time / T)
    return [*states, "a", *law, "model", *queue_names("sent", late), *queue_names("command", max(c.delay, 1))]


def surge_loop(g: Gains, hull: Hull, actuator: Actuator) -> System:
    """The loop of surge speed and position along the path, broken at the surge force.

    Args:
        g: Constants of the law.
        hull: The hull about the path.
        actuator: True lag and dead time of the surge force.
    """
    c, T, n = g.surge, g.T, max(g.surge.delay, g.yaw.delay)
    forms = Forms(names_of(["x", "u"], ["px", "pu", "fu", "su", "xi"], c, actuator, T))
    s = forms.now
    fu = s["fu"] + (1.0 - g.z_u) ** 2 / T * (s["u"] - s["pu"])
    x, u = s["px"] + (1.0 - g.z_p) * (s["x"] - s["px"]), s["pu"] + (1.0 - g.z_u**2) * (s["u"] - s["pu"])
    a = wrench_ahead(forms, c, n)
    later_x, later_u = x, u
    for each in a[1:]:
        later_x, later_u = later_x + T * (later_u + 0.5 * T * (fu + each)), later_u + T * (fu + each)
    u_c, du_c = -(g.k_p * later_x + s["xi"]), -g.k_p * later_u
    command = command_of(forms, du_c - fu - g.lead_u * (fu - s["su"]) - g.k2 * (later_u - u_c), a[-1], c)
    acting = fu + forms.next["model"]
    forms.next |= {
        "px": x + T * (u + 0.5 * T * acting),
        "pu": u + T * acting,
        "fu": fu,
        "su": _slow_part(s["su"], fu, g.step_fu),
        "xi": s["xi"] + _integral_step(g, hull) * later_x,
    }
    motion = np.array([[0.0, 1.0], [0.0, hull.surge]]), np.array([0.0, hull.surge_gain])
    add_plant(forms, ["x", "u"], motion, actuator, forms.free, T)
    return forms.system(command)


def _slow_part(slow: Form, of: Form, step: float) -> Form:
    """The slow part one period later; a filter of no bandwidth stays at zero, and its state is no pole of the loop."""
    return slow + step * (of - slow) if step > 0.0 else 0.0 * of


def _integral_step(g: Gains, hull: Hull) -> float:
    """The change of the integral in a period per metre of error."""
    return g.T * g.k_i * hull.speed**2 / (hull.speed**2 + g.U_xi**2)


def yaw_loop(g: Gains, hull: Hull, actuator: Actuator, *, at_guidance: bool = False) -> System:
    """The loop of yaw rate, heading, sway and position across the path.

    Args:
        g: Constants of the law.
        hull: The hull about the path.
        actuator: True lag and dead time of the yaw moment.
        at_guidance: Broken at the yaw rate that the guidance commands instead of at the yaw moment.
    """
    c, T, U, n = g.yaw, g.T, hull.speed, max(g.surge.delay, g.yaw.delay)
    states, law = ["y", "psi", "v", "r"], ["py", "ppsi", "pv", "pr", "fv", "fr", "xi", "rate", "integral", "slow", "sr", "behind"]
    forms = Forms(names_of(states, law + (["delta", "b"] if hull.carriage else []), c, actuator, T))
    s = forms.now
    y_d, v_d, a_d = _point(forms, hull.carriage, T)
    poles = {"y": g.z_p, "psi": g.z_h, "v": g.z_v**2, "r": g.z_r**2}
    y, psi, v, r = (s["p" + name] + (1.0 - pole) * (s[name] - s["p" + name]) for name, pole in poles.items())
    fv = s["fv"] + (1.0 - g.z_v) ** 2 / T * (s["v"] - s["pv"])
    fr = s["fr"] + (1.0 - g.z_r) ** 2 / T * (s["r"] - s["pr"])
    a = wrench_ahead(forms, c, n)
    later: tuple[Form, ...] = (y, psi, v, r)
    for each in a[1:]:
        later = _predicted(later, fv, fr + each, U, T)
    goal = y_d + n * T * (v_d + 0.5 * n * T * a_d), v_d + n * T * a_d, a_d
    beyond = fv - a_d
    epsilon = _heading_error(later, goal, g, U, s["xi"])
    turning = g.c * epsilon + _course_rate(later, goal, a_d + s["slow"] + g.eta * (beyond - s["slow"]), g, U)
    turning = turning + g.b * g.w_b * U**2 / (U**2 + g.U_xi**2) * (epsilon - s["behind"])
    error = (forms.free if at_guidance else turning) - s["rate"]
    drate = s["integral"] + g.step_c * error
    command = command_of(forms, drate - fr - g.lead_r * (fr - s["sr"]) - g.k1 * (later[3] - s["rate"]), a[-1], c)
    model = _predicted((y, psi, v, r), fv, fr + forms.next["model"], U, T)
    forms.next |= dict(zip(("py", "ppsi", "pv", "pr"), model, strict=True)) | {
        "fv": fv, "slow": _slow_part(s["slow"], beyond, g.step_s), "fr": fr, "sr": _slow_part(s["sr"], fr, g.step_f),
        "behind": _slow_part(s["behind"], epsilon, g.step_b if g.b > 0.0 else 0.0),
        "xi": s["xi"] + _integral_step(g, hull) * (later[0] - goal[0]), "rate": s["rate"] + T * drate,
        "integral": s["integral"] + g.kappa * g.lambda_c * g.step_c * T * error,
    }  # fmt: skip
    A = np.zeros((4, 4))
    A[0], A[1, 3], A[2:, 2:] = [0.0, U, 1.0, 0.0], 1.0, hull.lateral
    received = command if at_guidance else forms.free
    add_plant(forms, states, (A, np.append([0.0, 0.0], hull.lateral_gain)), actuator, received, T)
    return forms.system(turning if at_guidance else command)


def _predicted(motion: tuple[Form, ...], dv: Form, dr: Form, U: float, T: float) -> tuple[Form, ...]:
    """The motion across the path one period later."""
    y, psi, v, r = motion
    middle = psi + 0.5 * T * (r + 0.5 * T * dr)
    return y + T * (U * middle + v + 0.5 * T * dv), psi + T * (r + 0.5 * T * dr), v + T * dv, r + T * dr


def _point(forms: Forms, carriage: Carriage | None, T: float) -> tuple[Form, Form, Form]:
    """The point of the reference across the path, its velocity and acceleration, which follow the true heading and yaw rate."""
    if carriage is None:
        return 0.0 * forms.free, 0.0 * forms.free, 0.0 * forms.free
    s, (x, omega, q) = forms.now, carriage
    beyond = s["psi"] - s["delta"]
    rate = omega * beyond + s["b"]
    forms.next |= {"delta": s["delta"] + T * rate, "b": s["b"] + T * q * beyond}
    return x * s["delta"], x * rate, x * (omega * (s["r"] - rate) + q * beyond)


def _heading_error(motion: tuple[Form, ...], goal: tuple[Form, Form, Form], g: Gains, U: float, xi: Form) -> Form:
    """The heading error epsilon about a straight path, towards a point that moves across it.

    Args:
        motion: y, psi, v, r.
        goal: Position, velocity and acceleration of the point.
        g: Constants of the law.
        U: Speed, m/s.
        xi: The integral.
    """
    (y, psi, v, _), (y_d, v_d, _) = motion, goal
    return (v_d - g.k_p * (y - y_d) - xi - U * psi - v) / math.sqrt(U * U + (g.c * g.rho) ** 2)


def _course_rate(motion: tuple[Form, ...], goal: tuple[Form, Form, Form], dv: Form, g: Gains, U: float) -> Form:
    """The yaw rate r_w at which the course follows the velocity command, for the sway acceleration dv; see `_heading_error`."""
    (_, psi, v, _), (_, v_d, a_d) = motion, goal
    W2 = U * U + (g.c * g.rho) ** 2
    return U * (a_d - g.k_p * (U * psi + v - v_d)) / W2 - U * U / W2 * dv / math.sqrt(W2)
