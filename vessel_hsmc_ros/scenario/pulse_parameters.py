"""Parameters of the pulse widths that drive commands: one propeller curve for all thrusters."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.thrust_curve import HIGHEST, LOWEST, ThrustCurve, thrust_curve


@dataclass(frozen=True)
class PulseParameters:
    """Thrusters, deadband and measured curve of the speed controllers.

    Raises:
        ParameterError: the curve is none, or a sign is missing.
    """

    thrusters: tuple[str, ...] = parameter(
        ("port", "starboard"), "Names of the thrusters, whose thrusts thruster_allocation commands."
    )
    neutral: float = parameter(1500.0, "Pulse width of rest, which is commanded at zero.", unit="µs", low=LOWEST, high=HIGHEST)
    deadband: float = parameter(
        25.0, "Distance from neutral up to which the thrust is zero; pulses jump across it.", unit="µs", low=0.0, high=300.0
    )
    curve_pulses: tuple[float, ...] = parameter(
        (1100.0, 1900.0), "Pulse widths at which the thrust was measured, increasing.", unit="µs", low=LOWEST, high=HIGHEST
    )
    curve_thrusts: tuple[float, ...] = parameter(
        (-40.0, 50.0), "The measured thrust of one thruster at each, increasing; beyond them the pulse is limited.", unit="N"
    )
    reversed: tuple[float, ...] = parameter(
        (1.0,),
        "For each thruster, or one for all, 1, or -1 where a longer pulse drives astern, as with a propeller of the other hand.",
        low=-1.0,
        high=1.0,
    )

    def __post_init__(self) -> None:
        self.curve()
        if len(self.reversed) not in (1, len(self.thrusters)) or any(abs(sign) != 1.0 for sign in self.reversed):
            raise ParameterError(
                f"drive.pwm.reversed = {list(self.reversed)} is not allowed: it takes 1 or -1,"
                f" one or {len(self.thrusters)} of them"
            )

    def curve(self) -> ThrustCurve:
        """The measured curve."""
        return thrust_curve(self.neutral, self.deadband, self.curve_pulses, self.curve_thrusts, "drive.pwm")

    def signs(self) -> tuple[float, ...]:
        """The sign of each thruster."""
        return self.reversed * len(self.thrusters) if len(self.reversed) == 1 else self.reversed
