"""Nonlinear model predictive control with a perfect model: a reference for laws that do not know the ship.

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
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.studies.rivals.nmpc_model import Model, ModelParameters, compile_horizon

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
        """Estimate the disturbance, extrapolate the reference, improve the plan, apply its first inputs; see `Law.step`.

        Raises ControlError if the predicted motion is not finite.
        """
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
        """The target over the horizon, and the present inputs of the reference.

        `acceleration`: derivatives of its body velocities. `b`: estimated hull-fixed disturbance, which the target's inputs
        compensate.
        """
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
