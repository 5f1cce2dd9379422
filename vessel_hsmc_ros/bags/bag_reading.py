"""A recorded run of one vessel, as the command line and the reports take it."""

from dataclasses import dataclass
from pathlib import Path

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.messages import conversions
from vessel_sim_node.plant import Vessel


@dataclass(frozen=True)
class Recording:
    """What a bag holds of one vessel.

    Attributes:
        run: The arrays of the run.
        messages: Messages by topic.
        status: The last diagnostics of each node: figures by name.
    """

    run: Run
    messages: dict[str, int]
    status: dict[str, dict[str, str]]


def read_recording(directory: Path, vessel: Vessel | None = None) -> Recording:
    """Read the bag of one vessel's run, in whatever namespace.

    Args:
        directory: The bag's folder.
        vessel: The plant's coefficients, which turn disturbing forces into accelerations; those of the bag's scenario if
            not given.

    Raises:
        BagError: the bag cannot be read, or lacks a topic that every run has.
    """
    bag = open_bag(directory)
    run = bag.run(vessel)
    status: dict[str, dict[str, str]] = {}
    if "/diagnostics" in bag.topics:
        for _, _, message in bag.messages("/diagnostics"):
            status.update(conversions.read_status(message, bag.namespace()[1:]))
    return Recording(run, {name: series.count for name, series in bag.topics.items()}, status)
