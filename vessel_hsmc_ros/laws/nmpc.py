"""Nonlinear model-predictive control with a perfect model: the upper bound that the other laws are measured against.

| symbol | meaning | unit |
|---|---|---|
| U | inputs over the horizon as parts of their limits, the law's plan, shape (2·N,) | - |
| X, X_d | motion of ship and reference over the horizon, shape (N, 6) | as the state |
| q, R, D | weights of the errors, of the inputs, of their changes | - |
| b, e | estimated disturbance, turning with the hull and staying with the earth | N, N, N·m; N, N |
| w_o | bandwidth of the estimate | rad/s |

Every period: minimise sum q·(X - X_d)² + R·(U - U_d)² + D·(dU)² over the horizon within the limits, by a Gauss-Newton step from
the last plan (a real-time iteration), and apply the plan's first inputs. X_d is the reference carried on by the same model: its
inputs U_d follow from its state and acceleration and go on changing as they do now. What the model did not foresee is taken for
a disturbance and foreseen from then on, so that it leaves no lasting error.
Of the heading only a trace is asked for: the hull must be free to take the crab angle, or at rest the turns, that hold the place.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.nmpc_model import Model, ModelParameters, compile_horizon
from vessel_hsmc_ros.laws.terms import Terms

Array = NDArray[np.float64]

SUDDEN = 0.2
"""A rate of the reference's inputs above this, in limits per second, is a jump: it says nothing about the future."""


def weight(default: float, description: str, unit: str = "") -> float:
    """Declare a weight that may be changed while the law runs."""
    return parameter(default, description, unit=unit, low=0.0, high=1e9, tunable=True)


@dataclass(frozen=True)
class NmpcParameters:
    """Horizon, weights and the model; how they were found stands in docs/baselines.md."""

    step_lengths: tuple[float, ...] = parameter(
        (0.25, 0.5, 1.0), "Lengths of the horizon's steps, from the near to the far part.", unit="s", low=1e-3, high=10.0
    )
    steps: int = parameter(8, "Steps of each length.", low=1, high=50)
    iterations: int = parameter(1, "Gauss-Newton steps in a period.", low=1, high=50)
    position_weight: float = weight(1.0, "Weight of the position error.", "1/m²")
    heading_weight: float = weight(1e-4, "Weight of the heading error of a ship at rest.", "1/rad²")
    course_weight: float = weight(1e-3, "Further weight of the heading error, for each (m/s)² of the reference.", "s²/m²")
    effort_weight: float = weight(1e-4, "Weight of the inputs beside the reference's, in parts of their limits.")
    change_weight: float = weight(1e-3, "Weight of the inputs' change from step to step, in parts of their limits.")
    end_weight: float = weight(5.0, "How much more the horizon's last step weighs.")
    preview: float = weight(10.0, "How long the reference's inputs are taken to go on changing as they do.", "s")
    disturbance_bandwidth: float = weight(0.5, "Bandwidth of the estimate of the disturbance.", "rad/s")
    model: ModelParameters = group(ModelParameters)


class Plan(NamedTuple):
    """What the law carries from one period to the next.

    Attributes:
        U: Inputs over the horizon, (2·N,).
        state: x, y, psi, u, v, r of the last update, (6,); None at the first.
        U_d: Inputs of the reference then, (2,).
        b, e: Estimated disturbance, (3,), (2,).
    """

    U: Array
    state: Array | None
    U_d: Array
    b: Array
    e: Array


class Desired(NamedTuple):
    """The goal over the horizon: motion about the reference's present place, (N, 6), inputs, (2·N,), weights q, (6·N,)."""

    X: Array
    U: Array
    q: Array


class NmpcController(Law[NmpcParameters]):
    """The law with its memory: the last plan and the estimated disturbance.

    Args:
        parameters: Horizon, weights, model.
        vessel: What every law knows of the ship.
        period: Time between two updates, s.

    Raises:
        ParameterError: CasADi is not installed.
    """

    def __init__(self, parameters: NmpcParameters, vessel: KnownVessel, period: float) -> None:
        limits = (vessel.surge_force_limit, vessel.yaw_moment_limit)
        self._model = Model(vessel.surge_inertia, vessel.yaw_inertia, *limits, **schema.symbols(parameters.model))
        self._limits = np.array(limits)
        self._lengths = np.repeat(parameters.step_lengths, parameters.steps)
        self._middles = np.cumsum(self._lengths) - 0.5 * self._lengths
        self._iterations = parameters.iterations
        self._horizon = compile_horizon(self._model, tuple(self._lengths))
        super().__init__(parameters, vessel, period)

    def retune(self, parameters: NmpcParameters) -> None:
        """Take other weights and keep the plan; horizon and model stay as they were made."""
        p, N = parameters, len(self._lengths)
        self._tuned = p
        self._steps = self._lengths.copy()
        self._steps[-1] *= p.end_weight
        differences = (np.eye(2 * N) - np.eye(2 * N, k=-2))[2:]
        self._R = np.diag(p.effort_weight * np.repeat(self._lengths, 2)) + p.change_weight * differences.T @ differences

    def reset(self) -> None:
        """Forget the plan and the disturbance."""
        self.plan = Plan(np.zeros(2 * len(self._lengths)), None, np.zeros(2), np.zeros(3), np.zeros(2))

    def _step(self, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """Learn from what happened, look ahead, plan, apply the plan's beginning."""
        b, e = self._disturbance(state)
        desired, U_d = self._look_ahead(reference, reference_acceleration, b)
        U = desired.U.copy() if self.plan.state is None else self.plan.U
        U = np.clip(U, -1.0, 1.0)
        x = np.array([state[0] - reference[0], state[1] - reference[1], 0.0, *state[3:]])
        x[2] = reference[2] + wrap(float(state[2] - reference[2]))
        for _ in range(self._iterations):
            U = self._improved(U, x, b, e, desired)
        self.plan = Plan(U, state.copy(), U_d, b, e)
        errors = tracking_error(transform(state), transform(reference))
        cut = np.abs(U[:2]) >= 1.0
        return U[:2] * self._limits, Terms(*errors, surge_saturated=bool(cut[0]), yaw_saturated=bool(cut[1]))

    def _disturbance(self, state: Array) -> tuple[Array, Array]:
        """The estimates b and e after the last period: half of what the model missed is laid to either kind.

        A steady push on a turning hull is told apart by that: the wrong share turns with the hull, is missed, and goes over.
        """
        m, plan, T = self._model, self.plan, self._period
        if plan.state is None:
            return plan.b, plan.e
        foreseen = self._horizon.step(plan.state, plan.U[:2], plan.b, plan.e, T)[0][:, 0]
        part = (1.0 - math.exp(-self._tuned.disturbance_bandwidth * T)) / T
        missed = part * (state[3:] - foreseen[3:]) * np.array([m.m11, m.m22, m.m33])
        c, s = math.cos(state[2]), math.sin(state[2])
        over_earth = np.array([c * missed[0] - s * missed[1], s * missed[0] + c * missed[1]])
        return plan.b + missed * np.array([0.5, 0.5, 1.0]), plan.e + 0.5 * over_earth

    def _look_ahead(self, reference: Array, acceleration: Array, b: Array) -> tuple[Desired, Array]:
        """The reference over the horizon, and its present inputs."""
        inputs, sway_force = self._horizon.inputs(reference, acceleration)
        present = inputs[:, 0]
        rate = np.zeros(2)
        if self.plan.state is not None:
            rate = (present - self.plan.U_d) / self._period
            rate[np.abs(rate) > SUDDEN] = 0.0
        U = present + np.minimum(self._middles, self._tuned.preview)[:, None] * rate
        start = np.array([0.0, 0.0, *reference[2:]])
        (X,) = self._horizon.motion(start, U.T, (0.0, sway_force[0, 0], 0.0), (0.0, 0.0))
        speed = math.hypot(float(reference[3]), float(reference[4]))
        p = self._tuned
        q = np.array([p.position_weight, p.position_weight, p.heading_weight + p.course_weight * speed * speed, 0.0, 0.0, 0.0])
        U = U - np.array([b[0], b[2]]) / self._limits
        return Desired(X.T, U.ravel(), (self._steps[:, None] * q).ravel()), present

    def _improved(self, U: Array, x: Array, b: Array, e: Array, desired: Desired) -> Array:
        """One Gauss-Newton step within the limits.

        Raises:
            ControlError: the motion ahead is not finite.
        """
        X, G = self._horizon.sensitivity(x, U.reshape(-1, 2).T, b, e)
        error = (X.T - desired.X).ravel()
        if not np.isfinite(G).all():
            raise ControlError("the predictive law has no value: the motion ahead is not finite; are state and reference sane?")
        qG = desired.q[:, None] * G
        H = G.T @ qG + self._R
        gradient = qG.T @ error + self._R @ (U - desired.U)
        change = -np.linalg.solve(H, gradient)
        if np.any(np.abs(U + change) > 1.0):
            found = self._horizon.solver(h=H, g=gradient, a=np.zeros((0, len(U))), lbx=-1.0 - U, ubx=1.0 - U)
            change = np.array(found["x"])[:, 0]
        improved: Array = np.clip(U + change, -1.0, 1.0)
        return improved
