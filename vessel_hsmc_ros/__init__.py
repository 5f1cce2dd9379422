"""Control of underactuated ships over ROS 2: tracking and station keeping by sliding-mode and other laws.

The public interface, loaded when it is first used:

    simulate         run a scenario in this process, without ROS
    load_scenario    read and check a scenario
    make_controller  make a control law by its name
    run_campaign     run a scenario thousands of times with drawn parameters; read_rows reads the results
    Campaign         the plan of a campaign: the scenario of each of its runs
    open_bag         read a recorded bag as NumPy columns
    Run              the arrays of one run
    VesselHsmcError  base of all errors of this package; the others are in `vessel_hsmc_ros.core.exceptions`

and for the author of a control law, docs/own_law.md:

    Law, parameter        base class of a law, declaration of one of its parameters
    Motion, Acceleration  what a law receives: states of ship and reference, derivatives of the reference's velocities
    Terms                 what a law returns beside the wrench
    wrap, clip            an angle to (-pi, pi]; a number to a limit
    load_law_file         read the laws of a Python file, as `--law-file` does
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vessel_hsmc_ros.bags.reader import open_bag as open_bag
    from vessel_hsmc_ros.control.interface.law import Law as Law
    from vessel_hsmc_ros.control.interface.law import Terms as Terms
    from vessel_hsmc_ros.control.laws import make_controller as make_controller
    from vessel_hsmc_ros.core.exceptions import VesselHsmcError as VesselHsmcError
    from vessel_hsmc_ros.core.install_paths import __version__ as __version__
    from vessel_hsmc_ros.core.kernel import clip as clip
    from vessel_hsmc_ros.core.kinematics import Acceleration as Acceleration
    from vessel_hsmc_ros.core.kinematics import Motion as Motion
    from vessel_hsmc_ros.core.kinematics import wrap as wrap
    from vessel_hsmc_ros.core.metrics import Run as Run
    from vessel_hsmc_ros.core.schema import parameter as parameter
    from vessel_hsmc_ros.scenario.law_file import load_law_file as load_law_file
    from vessel_hsmc_ros.scenario.scenario import load_scenario as load_scenario
    from vessel_hsmc_ros.simulation.offline import simulate as simulate
    from vessel_hsmc_ros.studies.campaign.dataset import read_rows as read_rows
    from vessel_hsmc_ros.studies.campaign.execute import run_campaign as run_campaign
    from vessel_hsmc_ros.studies.campaign.plan import Campaign as Campaign

_ROOMS = {
    "__version__": "core.install_paths",
    "Acceleration": "core.kinematics",
    "Campaign": "studies.campaign.plan",
    "Law": "control.interface.law",
    "Motion": "core.kinematics",
    "Run": "core.metrics",
    "Terms": "control.interface.law",
    "VesselHsmcError": "core.exceptions",
    "clip": "core.kernel",
    "load_law_file": "scenario.law_file",
    "load_scenario": "scenario.scenario",
    "make_controller": "control.laws",
    "open_bag": "bags.reader",
    "parameter": "core.schema",
    "read_rows": "studies.campaign.dataset",
    "run_campaign": "studies.campaign.execute",
    "simulate": "simulation.offline",
    "wrap": "core.kinematics",
}

__all__ = [
    "Acceleration",
    "Campaign",
    "Law",
    "Motion",
    "Run",
    "Terms",
    "VesselHsmcError",
    "__version__",
    "clip",
    "load_law_file",
    "load_scenario",
    "make_controller",
    "open_bag",
    "parameter",
    "read_rows",
    "run_campaign",
    "simulate",
    "wrap",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: a node must not wait for what only an analysis needs."""
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_ROOMS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_ROOMS})
