"""A gymnasium environment of the plant: an agent keeps the station of a scenario's vessel, in its sea, with its sensors.

It needs the extra `gym`: `pip install 'vessel_hsmc_ros[gym]'`. The plant runs compiled, bit-identical to that of `simulate`.

    env = VesselEnv("realistic")
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, as_motion, to_body, wrap
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.plant.devices import Sampling
from vessel_hsmc_ros.plant.dynamics import acceleration
from vessel_hsmc_ros.plant.simulator import (
    PlantConstants,
    PlantState,
    Simulator,
    advance,
    apply,
    disturbance,
    is_finite,
    measure,
    shown,
)
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import compiled

FARTHEST = 20.0  # distance from the station at which an episode ends, ship lengths
HEADING_WEIGHT = 0.2  # what a heading that is 1 rad off costs, in ship lengths of distance


@kernel
def hold_command(
    times: Array,
    period: float,
    state: PlantState,
    wrench: tuple[float, float],
    sampled: Any,
    sensor_noise: Any,
    gust_noise: Any,
    c: PlantConstants,
) -> PlantState:
    """The state after some periods under one command, with the measurement of the last one.

    `times`: starts of the periods, (n,) s. `wrench`: commanded surge force, N, and yaw moment, N·m. `sampled`: whether each
    sensor samples at the end of a period, (n, 3). `sensor_noise`, `gust_noise`: standard normal numbers, (n, 6) and (n, 2).
    """
    for k in range(len(times)):
        disturbing = acceleration(disturbance(times[k], c, state), c.vessel)
        state = apply(state, wrench, c)
        state = advance(state, state.tau, disturbing, gust_noise[k], c)
        if not is_finite(state.motion):
            return state
        due = sampled[k]
        state = measure(state, due[0], due[1], due[2], sensor_noise[k], times[k] + period, c)
    return state


class VesselEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Station keeping: reward is minus the distance from the station in ship lengths, and a part of the heading's error.

    An observation is the measured position error ahead and to port in ship lengths, sine and cosine of the heading error, and
    surge and sway velocity in units of sqrt(g·L) and yaw rate in those of sqrt(g/L). An action is the share of the largest surge
    force and yaw moment. An episode ends FARTHEST ship lengths away, or where the motion diverges, and is truncated after
    `seconds`. The station is the origin, heading east; episodes start up to `spread` lengths away, with any heading.

    Args:
        scenario: A scenario, or its name; its law and reference are not used.
        seconds: Length of an episode.
        interval: Time between two actions, s.
        spread: Largest distance of the start, ship lengths.
        changes: Parameters that differ from the scenario's, by dotted names.

    Raises:
        ParameterError: a setting is not above zero, or thrusters drive the vessel.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as gymnasium declares it

    def __init__(
        self,
        scenario: str | Scenario = "realistic",
        seconds: float = 120.0,
        interval: float = 0.5,
        spread: float = 3.0,
        changes: dict[str, object] | None = None,
    ) -> None:
        for name, value in (("seconds", seconds), ("interval", interval), ("spread", spread)):
            if not value > 0.0:
                raise ParameterError(f"{name} must be above 0 (got {value:g})")
        made = load_scenario(scenario, changes) if isinstance(scenario, str) else scenario
        sim, known = made.vessel_sim, made.controller.vessel
        if sim.by_thrusters:
            raise ParameterError("vessel_sim.actuators.kind must be wrench for an environment (got thrusters)")
        self._period, self._length, self._spread = RateGrid(sim.rate_hz).period, known.length, spread
        self._limits = known.surge_force_limit, known.yaw_moment_limit
        self._held = max(1, round(interval / self._period))
        self._steps = max(1, round(seconds / (self._held * self._period)))
        self._simulator, self._rates = Simulator(sim, self._period), sim.sensors.rates()
        self._constants = self._simulator.constants()
        self._run = compiled(hold_command, "the plant")
        high = np.array([FARTHEST] * 2 + [1.0] * 2 + [10.0] * 3, dtype=np.float32)
        self.observation_space = gymnasium.spaces.Box(-high, high, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), dtype=np.float32)
        self._state = self._simulator.initial_state()
        self._step = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode at a random place; the seed decides that and all noise."""
        super().reset(seed=seed, options=options)
        self._simulator.reset()
        self._sampling, self._step = Sampling(self._rates), 0
        distance, bearing, psi = self.np_random.uniform((0.0, -np.pi, -np.pi), (self._spread * self._length, np.pi, np.pi))
        start = as_motion((distance * np.cos(bearing), distance * np.sin(bearing), psi, 0.0, 0.0, 0.0))
        state = self._simulator.initial_state()._replace(motion=start)
        noise = self.np_random.standard_normal(6).tolist()
        self._state = measure(state, *self._sampling.due(0), noise, 0.0, self._constants)
        return self._observation(), self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold a command for the interval between two actions."""
        share = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        wrench = float(share[0]) * self._limits[0], float(share[1]) * self._limits[1]
        n, first = self._held, self._step * self._held
        times = (first + np.arange(n)) * self._period
        ends = [round((first + k + 1) * self._period * 1e9) for k in range(n)]
        sampled = np.array([self._sampling.due(stamp) for stamp in ends])
        noise, gusts = self.np_random.standard_normal((n, 6)), self.np_random.standard_normal((n, 2))
        self._state = self._run(times, self._period, self._state, wrench, sampled, noise, gusts, self._constants)
        self._step += 1
        motion = self._state.motion
        lost = not is_finite(motion) or float(np.hypot(motion.x, motion.y)) > FARTHEST * self._length
        reward = (
            -FARTHEST if lost else -(float(np.hypot(motion.x, motion.y)) / self._length + HEADING_WEIGHT * abs(wrap(motion.psi)))
        )
        return self._observation(), float(reward), lost, self._step >= self._steps, self._info()

    def _observation(self) -> NDArray[np.float32]:
        m = shown(self._state, self._constants)
        if not is_finite(m):
            return np.zeros(7, dtype=np.float32)
        ahead, port = to_body(-m.x / self._length, -m.y / self._length, m.psi)
        speed, turn = np.sqrt(GRAVITY * self._length), np.sqrt(GRAVITY / self._length)
        values = ahead, port, np.sin(-m.psi), np.cos(m.psi), m.u / speed, m.v / speed, m.r / turn
        space = self.observation_space
        assert isinstance(space, gymnasium.spaces.Box)  # noqa: S101 - for the type checker
        return np.clip(np.array(values, dtype=np.float32), space.low, space.high)

    def _info(self) -> dict[str, Any]:
        """The true motion, and the time since the start, s."""
        motion: Motion = self._state.motion
        return {"motion": motion, "time": self._step * self._held * self._period}
