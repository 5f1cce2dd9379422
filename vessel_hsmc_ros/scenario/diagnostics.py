"""The parameters of diagnostics and black box."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from vessel_hsmc_ros.core.schema import parameter


@dataclass(frozen=True)
class DiagnosticsParameters:
    """Limits above which diagnostics warn; they have no effect on what is commanded."""

    surface_limit: float = parameter(
        math.inf,
        "Magnitude of a sliding surface, in its own unit, above which diagnostics warn; inf: never.",
        low=0.0,
        high=math.inf,
        tunable=True,
    )
    weight_norm_limit: float = parameter(
        math.inf,
        "Norm of a network's weights, in the unit of its output, above which diagnostics warn; inf: never.",
        low=0.0,
        high=math.inf,
        tunable=True,
    )


@dataclass(frozen=True)
class BlackBoxParameters:
    """The last messages of a node, kept in memory and written as a bag when an error occurs."""

    duration: float = parameter(
        30.0,
        "In real time, the time for which messages are kept; 0 turns the black box off. In lockstep it is off: the run's bag has"
        " them all.",
        unit="s",
        low=0.0,
        high=600.0,
    )
    directory: str = parameter(
        "",
        "Folder for the bags of the black box; empty means the folder black_box in the run's folder or, for a node that is"
        " started by hand, in ROS_LOG_DIR, ROS_HOME/log or ~/.ros/log.",
    )

    def within(self, folder: Path) -> "BlackBoxParameters":
        """The same with a directory in a folder, unless it has one."""
        return self if self.directory else replace(self, directory=str(folder / "black_box"))
