"""What shows that the ship does not do what is commanded: the monitors, fed from the control loop."""

from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.safety.monitors import Alarm, Innovation, Monitor, NotMoving, Saturation
from vessel_hsmc_ros.safety.parameters import MonitorParameters
from vessel_hsmc_ros.safety.reasons import Reason
from vessel_hsmc_ros.safety.velocities import Velocities


class Watch:
    """The monitors of a control loop.

    Args:
        parameters: Their bounds and times.
        limits: Largest surge force and yaw moment, N and N·m.
        length: Of the ship, m.
    """

    def __init__(self, parameters: MonitorParameters, limits: tuple[float, float], length: float) -> None:
        self._moving, self._saturation = NotMoving(parameters, limits), Saturation(parameters, limits)
        self._innovation, self._velocities = Innovation(parameters), Velocities(parameters, length)

    @property
    def monitors(self) -> tuple[Monitor, ...]:
        """All monitors, the most important first."""
        return self._moving, self._velocities, self._innovation, self._saturation

    def reset(self) -> None:
        """Forget the past."""
        for monitor in self.monitors:
            monitor.reset()

    def step(
        self,
        command: tuple[float, float],
        motion: Motion,
        observer: Observer | None,
        period: float,
        measured: tuple[int, Motion],
    ) -> Reason:
        """Watch a control period; returns the reason of the first monitor that demands the safe action.

        Args:
            command: The last command, N and N·m.
            motion: The motion that the law takes.
            observer: What estimates the motion, if anything does.
            period: s.
            measured: Time of the latest measurement, ns, and the motion as measured.
        """
        self._moving.step(command, (motion.u, motion.r), period)
        self._saturation.step(command, period)
        if observer:
            # The observer itself tests each new sample, and no other: sensors may be slower than the control period.
            self._innovation.step(not observer.accepts, period)
        else:  # which takes no velocities
            self._velocities.step(*measured, period)
        return next((monitor.reason for monitor in self.monitors if monitor.alarm is Alarm.SAFE), Reason.NONE)
