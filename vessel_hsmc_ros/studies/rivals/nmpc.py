"""Nonlinear model predictive control: the ship model with its sensitivities over the horizon, and the law.

The equations repeat those of the plant on purpose: a law must not import the plant, because a mistake in shared equations would
cancel out in every closed-loop test. They are written for CasADi, which differentiates them. They are (6) only, without coupling
of sway and yaw: on a hull that has it, the estimated disturbance b takes up the difference.

| symbol | meaning | unit |
|---|---|---|
| x | position relative to the reference, heading, body velocities, shape (6,) | m, m, rad, m/s, m/s, rad/s |
| U | inputs over the horizon, normalised by their limits, shape (2, N) | - |
| b | hull-fixed disturbance: two forces, a moment, shape (3,) | N, N, N·m |
| e | earth-fixed disturbance: two forces, shape (2,) | N, N |
| h | lengths of the steps, shape (N,) | s |

| symbol | meaning | unit |
|---|---|---|
| U | planned inputs over the horizon, normalised by their limits, shape (2·N,) | - |
| X, X_d | predicted motion of ship and reference over the horizon, shape (N, 6) | as the state |
| q, R, D | weights of the errors, of the inputs, of the input changes | - |
| b, e | estimated disturbance, fixed to the hull and fixed to the earth | N, N, N·m; N, N |
| w_o | bandwidth of the disturbance estimate | rad/s |

Each period: minimise sum q·(X - X_d)² + R·(U - U_d)² + D·(dU)² over the horizon subject to the input limits, by one Gauss-Newton
step from the last plan (real-time iteration), and apply the first inputs of the plan. X_d is the reference extrapolated by the
same model: its inputs U_d follow from its state and acceleration, and their present rate of change is assumed to persist. The
prediction error of the last period is attributed to a disturbance, which the next prediction includes; this acts as
integral action and removes the steady-state error.
The weight of the heading is small on purpose: the hull must be free to take the crab angle under a disturbance, or to turn in
station keeping.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownDamping, KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import group, parameter


@dataclass(frozen=True)
class ModelParameters(KnownDamping):
    """Coefficients of a perfect model besides m11 and m33; the defaults are the ship of the paper's section 6.2."""

    sway_inertia: float = parameter(177.9e3, "Mass with added mass in sway.", unit="kg", low=1e-3, high=1e12, symbol="m22")


class Model(NamedTuple):
    """The coefficients of (6) by the paper's symbols, and the limits by which the inputs are normalised."""

    m11: float
    m33: float
    tau_1_max: float
    tau_2_max: float
    m22: float
    d_u: float
    d_v: float
    d_r: float
    d_u2: float
    d_u3: float
    d_v2: float
    d_v3: float
    d_r2: float
    d_r3: float


class Compiled:
    """A CasADi function on NumPy arrays.

    Arguments and results are exchanged through CasADi's buffer interface: the conversion to and from its own matrix type takes
    longer than the evaluation.
    """

    def __init__(self, function: Any) -> None:
        inputs = [np.zeros(function.numel_in(k)) for k in range(function.n_in())]
        outputs = [np.zeros(function.numel_out(k)) for k in range(function.n_out())]
        # CasADi reads and writes these arrays in place, in column-major order; the views below reshape the same memory.
        self._buffer, self._evaluate = function.buffer()
        for k, values in enumerate(inputs):
            self._buffer.set_arg(k, memoryview(values.data))
        for k, values in enumerate(outputs):
            self._buffer.set_res(k, memoryview(values.data))
        self._inputs = [a.reshape(function.size_in(k), order="F") for k, a in enumerate(inputs)]
        self._outputs = [a.reshape(function.size_out(k), order="F") for k, a in enumerate(outputs)]

    def __call__(self, *arguments: Any) -> list[Array]:
        """Evaluate the function. Returns every output as a matrix."""
        for place, argument in zip(self._inputs, arguments, strict=True):
            place[...] = np.reshape(argument, place.shape)
        self._evaluate()
        return [output.copy() for output in self._outputs]


class Horizon(NamedTuple):
    """Compiled functions of a model over a horizon."""

    inputs: Compiled  # x, (du, dv, dr) -> the inputs that cause du and dr, (2,), and the sway force that dv needs, N
    step: Compiled  # x, u, b, e, length -> x after one step
    motion: Compiled  # x, U, b, e -> x after every step, (6, N)
    # x, U, b, e -> x after every step, (6, N), and its derivatives with respect to the inputs, (6·N, 2·N)
    sensitivity: Compiled
    solver: Any  # solver of a quadratic programme with bounds


def load_casadi() -> Any:
    """Import CasADi, which differentiates the model and solves the quadratic programme."""
    try:
        import casadi
    except ModuleNotFoundError:
        raise ParameterError("controller.law = nmpc needs CasADi, the package's extra `nmpc` (pip install casadi)") from None
    return casadi


def derivative(ca: Any, model: Model, x: Any, u: Any, b: Any, e: Any) -> Any:
    """The time derivative of x by (6) as a CasADi expression.

    `x`: state, (6,). `u`: inputs normalised by their limits, (2,). `b`, `e`: hull-fixed and earth-fixed disturbance, (3,),
    (2,). Returns dx, (6,).
    """
    m = model
    psi, surge, sway, yaw = x[2], x[3], x[4], x[5]
    c, s = ca.cos(psi), ca.sin(psi)
    drag_u = surge * (m.d_u + m.d_u2 * ca.fabs(surge) + m.d_u3 * surge * surge)
    drag_v = sway * (m.d_v + m.d_v2 * ca.fabs(sway) + m.d_v3 * sway * sway)
    drag_r = yaw * (m.d_r + m.d_r2 * ca.fabs(yaw) + m.d_r3 * yaw * yaw)
    return ca.vertcat(
        surge * c - sway * s,
        surge * s + sway * c,
        yaw,
        (m.m22 * sway * yaw - drag_u + m.tau_1_max * u[0] + b[0] + c * e[0] + s * e[1]) / m.m11,
        (-m.m11 * surge * yaw - drag_v + b[1] - s * e[0] + c * e[1]) / m.m22,
        ((m.m11 - m.m22) * surge * sway - drag_r + m.tau_2_max * u[1] + b[2]) / m.m33,
    )


def _rk4(ca: Any, model: Model, x: Any, u: Any, b: Any, e: Any, h: Any) -> Any:
    """One Runge-Kutta step of length h from x, as a CasADi expression."""
    k1 = derivative(ca, model, x, u, b, e)
    k2 = derivative(ca, model, x + 0.5 * h * k1, u, b, e)
    k3 = derivative(ca, model, x + 0.5 * h * k2, u, b, e)
    k4 = derivative(ca, model, x + h * k3, u, b, e)
    return x + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)


@lru_cache(maxsize=4)
def compile_horizon(model: Model, steps: tuple[float, ...]) -> Horizon:
    """Compile the functions of a horizon; this takes about a second, so the results are cached."""
    ca = load_casadi()
    N = len(steps)
    x, u, b, e, h = (ca.SX.sym(name, size) for name, size in (("x", 6), ("u", 2), ("b", 3), ("e", 2), ("h", 1)))
    after = _rk4(ca, model, x, u, b, e, h)
    linear = ca.Function("linear", [x, u, b, e, h], [after, ca.jacobian(after, x), ca.jacobian(after, u)], {"cse": True})

    # The sensitivities G of the states to all inputs, step by step: dx' = A·dx + B·dU_k.
    U = ca.SX.sym("U", 2, N)
    at, G, states, rows = x, ca.SX.zeros(6, 2 * N), [], []
    for k, length in enumerate(steps):
        at, A, B = linear(at, U[:, k], b, e, length)
        G = ca.horzcat(A @ G[:, : 2 * k], B, ca.SX.zeros(6, 2 * (N - k - 1)))
        states.append(at)
        rows.append(G)
    motion = ca.horzcat(*states)

    a = ca.SX.sym("a", 3)
    free = derivative(ca, model, x, ca.SX.zeros(2), ca.SX.zeros(3), ca.SX.zeros(2))
    # Inverse dynamics: the force beyond the unforced motion that the acceleration a requires, in each degree of freedom.
    missing = ca.vertcat(model.m11, model.m22, model.m33) * (a - free[3:])
    inputs = ca.vertcat(missing[0] / model.tau_1_max, missing[2] / model.tau_2_max)

    def compiled(arguments: list[Any], results: list[Any]) -> Compiled:
        dense = [ca.densify(result) for result in results]
        return Compiled(ca.Function("f", arguments, dense, {"cse": True}))

    # A quadratic programme with bounds on the variables only: its matrix of linear constraints has no rows.
    box = {"h": ca.Sparsity.dense(2 * N, 2 * N), "a": ca.Sparsity(0, 2 * N)}
    return Horizon(
        compiled([x, a], [inputs, missing[1]]),
        compiled([x, u, b, e, h], [after]),
        compiled([x, U, b, e], [motion]),
        compiled([x, U, b, e], [motion, ca.vertcat(*rows)]),
        ca.conic("solver", "daqp", box, {"error_on_fail": False}),
    )


SUDDEN = 0.2  # a faster change of the reference's inputs is a step, which must not be extrapolated, in limits per second


def weight(default: float, description: str, unit: str = "") -> float:
    """Declare a non-negative weight that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e9, tunable=True)


@dataclass(frozen=True)
class NmpcParameters:
    """Horizon, weights and the model; docs/baselines.md describes how they were tuned."""

    step_lengths: tuple[float, ...] = parameter(
        (0.25, 0.5, 1.0), "Lengths of the horizon's steps, from its near to its far part.", unit="s", low=1e-3, high=10.0
    )
    steps: int = parameter(8, "Number of steps of each length.", low=1, high=50)
    iterations: int = parameter(1, "Gauss-Newton steps per period.", low=1, high=50)
    position_weight: float = weight(1.0, "Weight of the position error.", "1/m²")
    heading_weight: float = weight(1e-4, "Weight of the heading error in station keeping.", "1/rad²")
    course_weight: float = weight(1e-3, "Additional weight of the heading error per squared speed of the reference.", "s²/m²")
    effort_weight: float = weight(1e-4, "Weight of the inputs relative to the reference's, normalised by their limits.")
    change_weight: float = weight(1e-3, "Weight of the input changes from step to step, normalised by their limits.")
    end_weight: float = weight(5.0, "Factor on the weights of the horizon's last step.")
    preview: float = weight(10.0, "Time for which the reference's inputs are extrapolated.", "s")
    disturbance_bandwidth: float = weight(0.5, "Bandwidth of the disturbance estimate.", "rad/s")
    model: ModelParameters = group(ModelParameters)


class Plan(NamedTuple):
    """Internal state of the law."""

    U: Array  # inputs over the horizon, (2·N,)
    state: Motion | None  # state of the ship at the last step; None before the first
    U_d: Array  # inputs of the reference at the last step, (2,)
    # b, e: estimated disturbance, (3,), (2,)
    b: Array
    e: Array


class Target(NamedTuple):
    """Target over the horizon: motion relative to the reference's present position, (N, 6), inputs, (2·N,), weights q, (6·N,)."""

    X: Array
    U: Array
    q: Array


class NmpcController(Law[NmpcParameters]):
    """The law with its internal state: the last plan and the disturbance estimate.

    Attributes:
        plan: Internal state: the planned inputs and the disturbance estimate.
        horizon: The compiled model.

    Raises:
        ParameterError: CasADi is not installed.
    """

    name = "nmpc"

    def __init__(self, parameters: NmpcParameters, vessel: KnownVessel, period: float) -> None:
        limits = (vessel.surge_force_limit, vessel.yaw_moment_limit)
        self._model = Model(vessel.surge_inertia, vessel.yaw_inertia, *limits, **schema.symbols(parameters.model))
        self._limits = np.array(limits)
        self._lengths = np.repeat(parameters.step_lengths, parameters.steps)
        self._middles = np.cumsum(self._lengths) - 0.5 * self._lengths
        self._iterations = parameters.iterations
        self.horizon = compile_horizon(self._model, tuple(self._lengths))
        super().__init__(parameters, vessel, period)

    def retune(self, parameters: NmpcParameters) -> None:
        """Take new weights and keep the plan; horizon and model stay as constructed."""
        p, N = parameters, len(self._lengths)
        self._tuned = p
        # Each term is weighted by the length of its step, so that the sum approximates the integral over the horizon.
        self._steps = self._lengths.copy()
        self._steps[-1] *= p.end_weight
        # Differences of consecutive inputs: the two inputs of a step are adjacent in U, so step k + 1 is two columns further.
        differences = (np.eye(2 * N) - np.eye(2 * N, k=-2))[2:]
        self._R = np.diag(p.effort_weight * np.repeat(self._lengths, 2)) + p.change_weight * differences.T @ differences

    def reset(self) -> None:
        """Discard the plan and the disturbance estimate."""
        self.plan = Plan(np.zeros(2 * len(self._lengths)), None, np.zeros(2), np.zeros(3), np.zeros(2))

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """Estimate the disturbance, extrapolate the reference, improve the plan, apply its first inputs; see `Law.step`."""
        b, e = self._disturbance(motion)
        target, U_d = self._extrapolate(desired, acceleration, b)
        U = np.clip(target.U if self.plan.state is None else self.plan.U, -1.0, 1.0)
        # Positions are relative to the reference: far from the origin, small errors would otherwise lose their digits.
        psi = desired.psi + wrap(motion.psi - desired.psi)
        x = np.array([motion.x - desired.x, motion.y - desired.y, psi, *motion[3:]])
        for _ in range(self._iterations):
            U = self._improved(U, x, b, e, target)
        self.plan = Plan(U, motion, U_d, b, e)
        errors = tracking_error(transform(motion), transform(desired))
        surge, yaw = U[:2].tolist()
        force, moment = (U[:2] * self._limits).tolist()
        return (force, moment), Terms(*errors, surge_saturated=abs(surge) >= 1.0, yaw_saturated=abs(yaw) >= 1.0)

    def _disturbance(self, motion: Motion) -> tuple[Array, Array]:
        """The estimates b and e, corrected by the prediction error of the last period.

        Half of the error is attributed to either kind. On a turning hull this distinguishes the two: the share in the
        wrong estimate rotates with the wrong frame, causes an error again, and so moves to the right one.
        """
        m, plan, T = self._model, self.plan, self.period
        if plan.state is None:
            return plan.b, plan.e
        # The law's own last input is taken as the applied one: actuator dynamics count as a disturbance.
        predicted = self.horizon.step(plan.state, plan.U[:2], plan.b, plan.e, T)[0][:, 0]
        gain = (1.0 - math.exp(-self._tuned.disturbance_bandwidth * T)) / T
        error = gain * (np.array(motion[3:]) - predicted[3:]) * np.array([m.m11, m.m22, m.m33])
        c, s = math.cos(motion.psi), math.sin(motion.psi)
        earth_fixed = np.array([c * error[0] - s * error[1], s * error[0] + c * error[1]])
        return plan.b + error * np.array([0.5, 0.5, 1.0]), plan.e + 0.5 * earth_fixed

    def _extrapolate(self, desired: Motion, acceleration: Acceleration, b: Array) -> tuple[Target, Array]:
        """The target over the horizon, and the present inputs of the reference."""
        inputs, sway_force = self.horizon.inputs(desired, acceleration)
        present = inputs[:, 0]
        rate = np.zeros(2)
        if self.plan.state is not None:
            rate = (present - self.plan.U_d) / self.period
            rate[np.abs(rate) > SUDDEN] = 0.0
        U = present + np.minimum(self._middles, self._tuned.preview)[:, None] * rate
        start = np.array([0.0, 0.0, *desired[2:]])
        (X,) = self.horizon.motion(start, U.T, (0.0, sway_force[0, 0], 0.0), (0.0, 0.0))
        speed = math.hypot(desired.u, desired.v)
        p = self._tuned
        q = np.array([p.position_weight, p.position_weight, p.heading_weight + p.course_weight * speed * speed, 0.0, 0.0, 0.0])
        # Only surge and yaw are actuated; the sway component of b has no input that could cancel it.
        U = U - np.array([b[0], b[2]]) / self._limits
        return Target(X.T, U.ravel(), (self._steps[:, None] * q).ravel()), present

    def _improved(self, U: Array, x: Array, b: Array, e: Array, target: Target) -> Array:
        """The inputs after one Gauss-Newton step within the limits.

        `U`: inputs over the horizon, (2·N,). `x`: state of the ship relative to the reference's position, (6,). `b`, `e`:
        estimated disturbance, (3,), (2,). Raises ControlError if the predicted motion is not finite.
        """
        X, G = self.horizon.sensitivity(x, U.reshape(-1, 2).T, b, e)
        error = (X.T - target.X).ravel()
        if not np.isfinite(G).all():
            raise ControlError(
                "the predictive law is undefined: its predicted motion is not finite; check the state and the reference"
            )
        qG = target.q[:, None] * G
        # Gauss-Newton Hessian: the second derivatives of the motion are neglected; R regularises it.
        H = G.T @ qG + self._R
        gradient = qG.T @ error + self._R @ (U - target.U)
        change = -np.linalg.solve(H, gradient)
        # The unconstrained minimum is exact and cheap; the quadratic programme is solved only where a limit is active.
        if np.any(np.abs(U + change) > 1.0):
            found = self.horizon.solver(h=H, g=gradient, a=np.zeros((0, len(U))), lbx=-1.0 - U, ubx=1.0 - U)
            change = np.array(found["x"])[:, 0]
        improved: Array = np.clip(U + change, -1.0, 1.0)
        return improved
