"""The plant driven by thrusters instead of a wrench."""

import math
from collections.abc import Sequence
from typing import Any

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.parameters import PlantParameters
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState
from vessel_hsmc_ros.plant.thrusters import Thrusters, ThrusterState, hull_wrench, idle, respond, thrusters_of


class ThrusterPlant(Simulator):
    """A plant with thrusters.

    Args:
        parameters: Parameters of the plant, with a layout of thrusters.
        period: Time between two odometry messages, s.
    """

    def __init__(self, parameters: PlantParameters, period: float) -> None:
        self._layout = parameters.vessel.thrusters
        self._thrusters = thrusters_of(self._layout, period)
        super().__init__(parameters, period)

    def reset(self) -> None:
        """Return to the initial state, without thrust."""
        super().reset()
        self._thrust = idle(self._layout)

    def applied_thrusts(self, thrust: Sequence[float], angle: Sequence[float]) -> Wrench:
        """The wrench that the thrusters give, N, N, N·m; call it once per step, because it advances the thrusters.

        Args:
            thrust, angle: Demands in the order of the layout, N and rad; the angle of a fixed thruster is ignored.

        Raises:
            SimulationError: a demand is not finite.
        """
        for thruster, *demands in zip(self._layout.thrusters(), thrust, angle, strict=True):
            check_demand(thruster.name, *demands)
        self._state = apply_thrusts(self._state, thrust, angle, self._constants, self._thrust, self._thrusters)
        return self._state.tau


def make_plant(parameters: PlantParameters, period: float) -> Any:
    """The plant that parameters describe: driven by thrusters or by a wrench.

    Args:
        parameters: Parameters of the plant.
        period: Time between two odometry messages, s.
    """
    return (ThrusterPlant if parameters.by_thrusters else Simulator)(parameters, period)


@kernel
def apply_thrusts(
    state: PlantState, thrust: Sequence[float], angle: Sequence[float], c: PlantConstants, now: ThrusterState, t: Thrusters
) -> PlantState:
    """The state with the wrench tau that the thrusters give in this period.

    Args:
        state: State of the plant.
        thrust, angle: Demands, N and rad, finite.
        c: Constants of the plant.
        now, t: State of the thrusters, which is written, and their constants.
    """
    respond(now, thrust, angle, t)
    psi = state.motion.psi
    through_water = state.motion.u - (c.current[0] * math.cos(psi) + c.current[1] * math.sin(psi))
    return PlantState(state.motion, state.measured, hull_wrench(now, through_water, t), state.gust, state.commands, state.sent)


def check_demand(name: str, thrust: float, angle: float) -> None:
    """Reject a demand that is not finite: one NaN would remain in the state for ever.

    Args:
        name: Of the thruster.
        thrust, angle: Its demand, N and rad.

    Raises:
        SimulationError: thrust or angle is not finite.
    """
    if not (math.isfinite(thrust) and math.isfinite(angle)):
        raise SimulationError(f"thruster {name} cannot take {thrust} N and {angle} rad: both must be finite numbers")
