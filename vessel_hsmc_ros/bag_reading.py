"""From a bag back to arrays, without ROS."""

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader, AnyReaderError

from vessel_hsmc_ros import conversions
from vessel_hsmc_ros.exceptions import BagError
from vessel_hsmc_ros.kinematics import extrapolate
from vessel_hsmc_ros.run_data import Run
from vessel_hsmc_ros.timing import seconds
from vessel_sim_node.disturbance import acceleration
from vessel_sim_node.plant import Vessel

Array = NDArray[np.float64]

UNKNOWN = (math.nan, math.nan, math.nan)

_READERS = {
    "odom": conversions.read_odometry,
    "odom/truth": conversions.read_odometry,
    "reference": conversions.read_reference,
    "applied_wrench": conversions.read_wrench,
    "disturbance": conversions.read_disturbance,
    "dynamics/truth": conversions.read_acceleration,
    "controller/state": conversions.read_control_state,
}


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


def read_recording(directory: Path, vessel: Vessel) -> Recording:
    """Read the bag of one vessel's run, in whatever namespace.

    Args:
        directory: The bag's folder.
        vessel: The plant's coefficients, which turn disturbing forces into accelerations.

    Raises:
        BagError: the bag cannot be read, or lacks a topic that every run has.
    """
    series: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    status: dict[str, dict[str, str]] = {}
    try:
        with AnyReader([directory]) as reader:
            messages = {connection.topic: connection.msgcount for connection in reader.connections}
            prefix = _namespace(directory, messages)
            wanted = {prefix + name for name in _READERS} | {"/diagnostics"}
            connections = [connection for connection in reader.connections if connection.topic in wanted]
            for connection, _, data in reader.messages(connections):
                name = connection.topic.removeprefix(prefix)
                if name in _READERS:
                    message: Any = reader.deserialize(data, connection.msgtype)
                    series[name].append((conversions.nanoseconds(message.header.stamp), _READERS[name](message)))
                else:
                    status.update(conversions.read_status(reader.deserialize(data, connection.msgtype), prefix[1:]))
    except (AnyReaderError, OSError) as error:
        raise BagError(f"bag {directory} cannot be read: {error}") from None
    for name in ("odom", "reference", "applied_wrench", "disturbance"):
        if not series[name]:
            raise BagError(f"bag {directory} has no message on {prefix}{name}")
    return Recording(_run(series, vessel), messages, status)


def _namespace(directory: Path, topics: Iterable[str]) -> str:
    """What stands before `odom` in a bag's topics."""
    found = [topic.removesuffix("odom") for topic in topics if topic.endswith("/odom")]
    if len(found) != 1:
        raise BagError(f"bag {directory} has {len(found)} odometry topics: it takes one of a single vessel")
    return found[0]


def _run(series: dict[str, list[tuple[int, Any]]], vessel: Vessel) -> Run:
    """Rows at the stamps of the odometry that have a disturbance and an applied wrench."""
    wrench, disturbance = dict(series["applied_wrench"]), dict(series["disturbance"])
    odometry = [(t, s) for t, s in sorted(series["odom"], key=_stamp) if t in wrench and t in disturbance]
    if not odometry:
        raise BagError("no odometry message has an applied wrench and a disturbance of its stamp")
    stamps = [t for t, _ in odometry]
    truth, unforced = dict(series["odom/truth"]), dict(series["dynamics/truth"])
    start = stamps[0]
    control = series["controller/state"]
    columns = {"time": np.array([seconds(t - start) for t, _ in control])}
    for name in conversions.CONTROL_FIELDS if control else ():
        columns[name] = np.array([values[name] for _, values in control])
    return Run(
        np.array([seconds(t - start) for t in stamps]),
        np.array([truth.get(t, s) for t, s in odometry]),
        np.array([s for _, s in odometry]),
        _reference_at(stamps, sorted(series["reference"], key=_stamp)),
        np.array([wrench[t] for t in stamps]),
        np.array([acceleration(disturbance[t], vessel) for t in stamps]),
        np.array([unforced.get(t, UNKNOWN) for t in stamps]),
        columns,
    )


def _stamp(item: tuple[int, Any]) -> int:
    return item[0]


def _reference_at(stamps: list[int], references: list[tuple[int, tuple[Array, Array]]]) -> Array:
    """The latest reference not after each stamp, or the first, carried to that stamp."""
    times = np.array([t for t, _ in references])
    latest = np.maximum(np.searchsorted(times, stamps, side="right") - 1, 0)
    rows = []
    for stamp, index in zip(stamps, latest, strict=True):
        at, (reference, reference_acceleration) = references[index]
        rows.append(extrapolate(reference, reference_acceleration, seconds(stamp - at)))
    return np.array(rows)
