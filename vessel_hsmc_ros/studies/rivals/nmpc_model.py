"""The ship model of the predictive law, (6) with all coefficients, and its motion over the horizon with sensitivities.

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
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownDamping
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.schema import parameter


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
        """Evaluate the function.

        `arguments`: one array for each input, with as many elements. Returns every output as a matrix.
        """
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
    """Import CasADi, which differentiates the model and solves the quadratic programme.

    Raises ParameterError if CasADi is not installed.
    """
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
    """Compile the functions of a horizon; this takes about a second, so the results are cached.

    `steps`: lengths of the steps, s. Raises ParameterError if CasADi is not installed.
    """
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
