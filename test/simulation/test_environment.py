"""The gymnasium environment: it passes the checker, is reproducible, and its plant is that of the simulation."""

import numpy as np
import pytest

pytest.importorskip("gymnasium", exc_type=ImportError)

from gymnasium.utils.env_checker import check_env

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.environment import FARTHEST, VesselEnv

CALM = {"vessel_sim.sensors.position_noise": 0.0, "vessel_sim.sensors.heading_noise": 0.0}


@pytest.mark.long
@pytest.mark.parametrize("scenario", ["realistic", "case2_tracking"])
def test_gymnasium_finds_nothing_wrong(scenario: str) -> None:
    check_env(VesselEnv(scenario, seconds=5.0), skip_render_check=True)


def episode(env: VesselEnv, seed: int) -> list[float]:
    env.reset(seed=seed)
    env.action_space.seed(seed)
    numbers: list[float] = []
    ended = False
    while not ended:
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        numbers += [*observation.tolist(), reward]
        ended = terminated or truncated
    return numbers


def test_the_seed_decides_an_episode() -> None:
    env = VesselEnv("realistic", seconds=5.0)
    assert episode(env, 3) == episode(env, 3) == episode(VesselEnv("realistic", seconds=5.0), 3)
    assert episode(env, 3) != episode(env, 4)


def test_the_motion_is_bit_identical_to_that_of_the_simulator() -> None:
    env = VesselEnv("case2_tracking", seconds=10.0)
    _, info = env.reset(seed=1)
    sim = load_scenario("case2_tracking").vessel_sim
    plant = Simulator(sim, 1.0 / sim.rate_hz)
    plant._state = plant._state._replace(motion=as_motion(info["motion"]))
    known = load_scenario("case2_tracking").controller.vessel
    k = 0
    for share in ((0.5, 0.2), (-0.3, 0.0), (1.0, -1.0)):
        _, _, _, _, info = env.step(np.array(share, dtype=np.float32))
        wrench = tuple(
            float(np.float32(s)) * limit
            for s, limit in zip(share, (known.surge_force_limit, known.yaw_moment_limit), strict=True)
        )
        while k / sim.rate_hz < info["time"] - 1e-9:
            disturbing = plant.disturbance(k * (1.0 / sim.rate_hz))
            plant.advance(plant.applied((wrench[0], wrench[1])), disturbing)
            k += 1
        assert tuple(info["motion"]) == tuple(plant.state)


def test_an_episode_ends_far_away_and_rewards_the_station() -> None:
    env = VesselEnv("realistic", seconds=2000.0, interval=5.0)
    env.reset(seed=2)
    ended, rewards = False, []
    while not ended:
        _, reward, ended, truncated, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
        rewards.append(reward)
        assert not truncated
    assert np.hypot(*info["motion"][:2]) > FARTHEST * 32.0
    assert rewards[-1] == -FARTHEST
    assert max(rewards) <= 0.0


@pytest.mark.parametrize("name", ["seconds", "interval", "spread"])
def test_a_setting_that_is_not_above_zero_is_refused(name: str) -> None:
    with pytest.raises(ParameterError, match=rf"{name} must be above 0 \(got 0\)"):
        VesselEnv("realistic", **{name: 0.0})  # type: ignore[arg-type] # one of three numbers
