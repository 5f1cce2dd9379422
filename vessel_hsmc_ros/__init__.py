"""Control of underactuated ships over ROS 2: tracking and station keeping by sliding-mode and other laws.

The public interface, loaded when it is first used:

    simulate         run a scenario in this process, without ROS
    load_scenario    read and check a scenario
    make_controller  make a control law by its name
    open_bag         read a recorded bag as NumPy columns
    Run              the arrays of one run
    VesselHsmcError  base of all errors of this package; the others are in `vessel_hsmc_ros.core.exceptions`
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vessel_hsmc_ros.bags.reader import open_bag as open_bag
    from vessel_hsmc_ros.core.exceptions import VesselHsmcError as VesselHsmcError
    from vessel_hsmc_ros.core.run_data import Run as Run
    from vessel_hsmc_ros.core.version import __version__ as __version__
    from vessel_hsmc_ros.laws import make_controller as make_controller
    from vessel_hsmc_ros.runs.offline import simulate as simulate
    from vessel_hsmc_ros.scenario.scenario import load_scenario as load_scenario

_ROOMS = {
    "__version__": "core.version",
    "Run": "core.run_data",
    "VesselHsmcError": "core.exceptions",
    "load_scenario": "scenario.scenario",
    "make_controller": "laws",
    "open_bag": "bags.reader",
    "simulate": "runs.offline",
}

__all__ = ["Run", "VesselHsmcError", "__version__", "load_scenario", "make_controller", "open_bag", "simulate"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: a node must not wait for what only an analysis needs."""
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_ROOMS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_ROOMS})
