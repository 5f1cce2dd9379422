"""The topics of a vessel, and a run from their columns, by all messages of a topic at once; beside `messages.conversions`.

The results are bit-identical to what the nodes compute from single messages.
"""

import math
from collections.abc import Callable, Mapping
from functools import reduce
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion, extrapolate, in_body_frame
from vessel_hsmc_ros.core.metrics import Run, held
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages.state_columns import ODOMETRY
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, RELAYED
from vessel_hsmc_ros.plant.dynamics import Vessel, acceleration

Stamps = NDArray[np.int64]

PAUSE = 500_000_000  # age of a reference from which on a pause is assumed, ns
Topics = Mapping[str, Series]  # the topics of one vessel that have messages, by their names without its namespace
NEEDED = ("odom", "reference", "applied_wrench", "disturbance")
TOPICS = (*NEEDED, "odom/truth", "dynamics/truth", "controller/state", "controller/estimate", "cmd_wrench")
NORMALISED = "/normalised_wrench"  # a topic of the type of the wrenches whose numbers are shares of the limits


class VesselTopics:
    """The topics of the vessels in a bag.

    `given`: full names of topics by this package's names, where a person has given them.

    Raises:
        BagError: a topic that was given is not there, or of another type, or cannot be decoded.
    """

    def __init__(self, path: Path, topics: Mapping[str, Series], given: Mapping[str, str]) -> None:
        self.path, self.topics, self._given = path, topics, given
        for own, name in given.items():
            kind = RECORDED_TOPICS[own]
            if name not in self._of_type(kind):
                raise BagError(f"bag {path} has no {kind} on {name}: it has {', '.join(self._of_type(kind)) or 'none'}")

    def readable(self, name: str) -> bool:
        """Whether a topic, by its full name, has messages that can be decoded."""
        return bool(self.topics.get(name)) and not self.topics[name].undecodable

    @property
    def namespaces(self) -> list[str]:
        """The namespaces that hold a vessel's odometry: `/` or `/alpha/`."""
        odometry = [name for name, series in self.topics.items() if name.endswith("/odom") and series.type == ODOMETRY]
        names = [name.removesuffix("odom") for name in odometry]
        return [name for name in names if not name.endswith(f"/{RELAYED}")]

    def namespace(self, wanted: str | None = None) -> str:
        """The given namespace if it holds a vessel, or the only one that does, with its slashes.

        Where no topic has the name of the odometry, the only one of its type is that of a vessel in the root namespace. Raises
        BagError if there is no such vessel, or there are several to choose from.
        """
        parts = [part for part in (wanted or "").split("/") if part]
        if "odom" in self._given or not (self.namespaces or parts or self.find("/", "odom") is None):
            return "/" + "".join(f"{part}/" for part in parts)
        found = [name for name in self.namespaces if wanted is None or name.strip("/") == "/".join(parts)]
        if not found:
            where = "" if wanted is None else f" in namespace /{'/'.join(parts)}"
            raise BagError(f"bag {self.path} has no odometry{where}: {self._alternatives()}")
        if len(found) > 1:
            raise BagError(f"bag {self.path} has several vessels, in the namespaces {', '.join(found)}: choose one")
        return found[0]

    def find(self, prefix: str, own: str) -> Series | None:
        """The topic of a vessel by this package's name for it; None if the bag has no such messages that can be decoded.

        In a bag of one vessel it is the topic that was given, that of the name in the namespace, else the only one whose name
        ends so, and of odometry and applied wrench the only one of the type. `prefix`: the vessel's namespace, with its
        slashes. `own`: the name without the namespace, such as `odom`.
        """
        exact = self._given.get(own, prefix + own)
        if self.readable(exact):
            return self.topics[exact]
        if len(self.namespaces) > 1 or exact in self.topics:
            return None
        names = self._unnamed(own)
        found = [name for name in names if name.endswith(f"/{own}")]
        by_type = own == "odom" or (own == "applied_wrench" and self.find(prefix, "cmd_wrench") is None)
        found = found or (names if by_type else [])
        return self.topics[found[0]] if len(found) == 1 else None

    def _unnamed(self, own: str) -> list[str]:
        """The topics of the type of one of this package's, without those that are others of its own."""
        others = tuple(f"/{name}" for name, kind in RECORDED_TOPICS.items() if kind == RECORDED_TOPICS[own] and name != own)
        names = self._of_type(RECORDED_TOPICS[own])
        return [n for n in names if not n.endswith((*others, NORMALISED)) and f"/{RELAYED}" not in n]

    def _of_type(self, kind: str) -> list[str]:
        return [name for name, series in self.topics.items() if series.type == kind and self.readable(name)]

    def _alternatives(self) -> str:
        """The topics that may be odometry; without any all topics, with the reason for those that cannot be decoded."""
        reasons = {name: series.undecodable for name, series in self.topics.items()}
        texts = [f"{name} ({reason})" if reason else name for name, reason in reasons.items()]
        names = self._unnamed("odom")
        choice = f"choose one of {', '.join(names)} by --odometry; " if names else ""
        return f"{choice}its topics are {', '.join(texts) or 'none'}"


def states(series: Series) -> Array:
    """x, y, psi, u, v, r of odometry or reference messages, (n, 6)."""
    pose, twist = ("pose.pose", "twist.twist") if "pose.pose.position.x" in series else ("pose", "twist")
    x, y, z, w = (series[f"{pose}.orientation.{axis}"] for axis in "xyzw")
    with np.errstate(over="ignore", invalid="ignore"):  # a quaternion from a stranger: its heading is then NaN
        sines, cosines = 2.0 * (w * z + x * y), w * w + x * x - y * y - z * z
    # As in `heading_from_quaternion`; NumPy's arc tangent may differ from Python's in the last bit.
    heading = np.array([*map(math.atan2, sines.tolist(), cosines.tolist())])
    columns = [series[f"{pose}.position.x"], series[f"{pose}.position.y"], heading]
    columns += [series[f"{twist}.{name}"] for name in ("linear.x", "linear.y", "angular.z")]
    return np.column_stack(columns)


def measured_states(odometry: Series, twist_frame: str) -> Array:
    """`states` of odometry, with velocities along the hull whether they are given in the frame `child` or in that of the pose."""
    found = states(odometry)
    if twist_frame == "parent":
        # Row by row, for the bits of the nodes; NumPy's cosine may differ.
        found = np.array([in_body_frame(as_motion(row)) for row in found]).reshape(found.shape)
    return found


def accelerations(series: Series, group: str) -> Array:
    """Surge, sway and yaw acceleration from a message field with linear and angular parts, (n, 3)."""
    return series.stack(*(f"{group}.{name}" for name in ("linear.x", "linear.y", "angular.z")))


def wrenches(series: Series) -> Array:
    """Surge force, sway force and yaw moment of wrench messages, (n, 3)."""
    return series.stack("wrench.force.x", "wrench.force.y", "wrench.torque.z")


def forces(series: Series) -> Array:
    """Surge force and yaw moment of wrench messages, (n, 2): the ship has no sway actuator."""
    return wrenches(series)[:, [0, 2]]


def control(series: Series, start: int, lists: bool, estimates: Series | None) -> dict[str, Array]:
    """The terms that the law computed, by field names, with their `time` and, where there is an observer, `estimate`.

    `series`: the topic controller/state. `start`: stamp that `time` counts from, ns. `estimates`: the topic
    controller/estimate; None without an observer.
    """
    names = [name for name in series.fields if not name.startswith("header.") and (lists or name not in series.wide)]
    columns = {"time": seconds_of(series.stamp - start), **{name: _filled(series[name]) for name in names}}
    if estimates is not None:
        columns["estimate"] = at_stamps(series.stamp, estimates, states(estimates), np.nan)
    return columns


def _filled(column: Array) -> Array:
    """A column with lists of unlike lengths as one of numbers, (n, k), with NaN behind the shorter ones.

    A law that has not been computed, for instance during a pause, leaves the lists of its weights empty.
    """
    if column.dtype != object:
        return column
    rows = np.full((len(column), max(map(len, column))), math.nan)
    for row, values in zip(rows, column, strict=True):
        row[: len(values)] = values
    return rows


def run(topics: Topics, vessel: Vessel, weights: bool = True, twist_frame: str = "child") -> Run:
    """The run of one vessel, with a row for each stamp that odometry, disturbance and applied wrench have in common.

    `topics`: of TOPICS, those that the bag has. `vessel`: the plant's coefficients, which convert the disturbance from forces
    to accelerations. `twist_frame`: frame of the velocities in the odometry: child, or parent, that of the pose. Returns the
    arrays of the run; its time is zero at the first common stamp.
    """
    # Joined by stamp and not by position: topics may lack messages, at the end of a truncated bag for instance.
    odometry = topics["odom"]
    order = np.argsort(odometry.stamp, kind="stable")
    stamps = shown_at(odometry.stamp[order], topics["applied_wrench"].stamp)
    wrench, has_wrench = matched(stamps, topics["applied_wrench"])
    disturbance, has_disturbance = matched(stamps, topics["disturbance"])
    rows = np.flatnonzero(has_wrench & has_disturbance)
    if not len(rows):
        raise BagError("no odometry message has an applied wrench and a disturbance of its stamp")
    stamps, start = stamps[rows], int(stamps[rows[0]])
    measured = measured_states(odometry, twist_frame)[order][rows]
    no_acceleration = np.full((len(rows), 3), math.nan)
    terms = topics.get("controller/state")
    return Run(
        seconds_of(stamps - start),
        _optional(stamps, topics.get("odom/truth"), states, measured),  # without sensor noise there is no truth apart
        measured,
        references_at(stamps, topics["reference"]),
        forces(topics["applied_wrench"])[wrench[rows]],
        _accelerations(wrenches(topics["disturbance"])[disturbance[rows]], vessel),
        _optional(stamps, topics.get("dynamics/truth"), lambda series: accelerations(series, "accel"), no_acceleration),
        {} if terms is None else control(terms, start, weights, topics.get("controller/estimate")) | _commanded(topics),
    )


def first_row(topics: Topics) -> int:
    """The stamp at which the time of a complete run is zero: the first one with odometry, applied wrench and disturbance, ns."""
    # Messages before it belong to the start-up: their columns cannot form a row.
    return int(reduce(np.intersect1d, (topics[name].stamp for name in ("odom", "applied_wrench", "disturbance")))[0])


def partial_run(topics: Topics, twist_frame: str = "child") -> Run:
    """A run with a row for each odometry message; other topics are held, those that the bag lacks are NaN.

    The arguments are those of `run`.
    """
    odometry = topics["odom"]
    order = np.argsort(odometry.stamp, kind="stable")
    stamps = odometry.stamp[order]
    start = int(stamps[0])

    def latest(name: str, columns_of: Callable[[Series], Array], width: int) -> Array:
        if name not in topics:
            return np.full((len(stamps), width), np.nan)
        return held(topics[name].stamp, columns_of(topics[name]), stamps)

    pose = measured_states(odometry, twist_frame)[order]
    estimates = topics.get("controller/estimate")
    terms = topics.get("controller/state")
    return Run(
        time=seconds_of(stamps - start),
        state=latest("odom/truth", states, 6) if "odom/truth" in topics else pose,
        measured=pose,
        reference=latest("reference", states, 6),
        wrench=latest("applied_wrench", forces, 2),
        # The bag contains forces, the report shows accelerations: the masses for the conversion are known from a scenario only.
        disturbance=np.full((len(stamps), 3), np.nan),
        unforced_acceleration=np.full((len(stamps), 3), np.nan),
        control={} if terms is None else control(terms, start, lists=False, estimates=estimates),
    )


def _accelerations(wrench: Array, vessel: Vessel) -> Array:
    """The accelerations of the hull by wrenches, row by row, (n, 3)."""
    X, Y, N = cast("Any", wrench.T)  # the kernel takes arrays as well
    return np.column_stack(cast("tuple[Array, ...]", acceleration((X, Y, N), vessel)))


def _commanded(topics: Mapping[str, Series]) -> dict[str, Array]:
    """The wrench that the controller has commanded with its terms, as `commanded`."""
    if "cmd_wrench" not in topics:
        return {}
    commands = topics["cmd_wrench"]
    return {"commanded": at_stamps(topics["controller/state"].stamp, commands, forces(commands), np.nan)}


def _optional(stamps: Stamps, series: Series | None, values: Callable[[Series], Array], otherwise: Array) -> Array:
    """The values of a topic at some stamps, or other values of the same shape if the bag lacks the topic."""
    return otherwise if series is None else at_stamps(stamps, series, values(series), otherwise)


def at_stamps(stamps: Stamps, series: Series, values: Array, otherwise: Any) -> Array:
    """The values of the message with each stamp, (n, k).

    `stamps`: (n,), ns. `values`: a row for each of its messages, (m, k). `otherwise`: the value where no message has the stamp.
    """
    index, found = matched(stamps, series)
    return np.where(found[:, None], values[index], otherwise)


def matched(stamps: Stamps, series: Series) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Index of the last message with each stamp, and whether there is one; (n,) each."""
    order = np.argsort(series.stamp, kind="stable")
    times = series.stamp[order]
    index = np.searchsorted(times, stamps, side="right") - 1
    return order[np.maximum(index, 0)], (index >= 0) & (times[np.maximum(index, 0)] == stamps)


def shown_at(measured_at: Stamps, steps: Stamps) -> Stamps:
    """The times of the steps in which the plant has published its odometry, whose stamps are those of late measurements.

    The plant repeats its first measurement until it is as old as the delay: so the repetitions show the delay in steps.
    `measured_at`: stamps of the odometry, ascending, (n,) ns. `steps`: stamps of a message of every step, (m,) ns. Returns the
    stamps of the steps, (n,) ns; the stamps as they are where the first one is not repeated.
    """
    _, inverse, counts = np.unique(measured_at, return_inverse=True, return_counts=True)
    if not len(counts) or (late := counts[0] - 1) == 0:
        return measured_at
    steps = np.unique(steps)
    repetition = np.arange(len(measured_at)) - (np.cumsum(counts) - counts)[inverse]
    index = np.searchsorted(steps, measured_at) + np.where(counts[inverse] > 1, repetition, late)
    # Beyond the last step known there are times that no other message has.
    beyond = np.maximum(index - (len(steps) - 1), 0)
    return np.asarray(steps[index - beyond] + beyond)


def inputs_at(stamps: Stamps, reference: Series) -> tuple[NDArray[np.bool_], Array, Array]:
    """Whether there is a reference with each stamp (n,), its state (n, 6) and its acceleration (n, 3)."""
    index, found = matched(stamps, reference)
    return found, states(reference)[index], accelerations(reference, "acceleration")[index]


def references_at(stamps: Stamps, series: Series) -> Array:
    """The latest reference that is not newer than each stamp, or the first, extrapolated to the stamp; (n, 6).

    After a pause the next reference is taken where it is closer.
    """
    order = np.argsort(series.stamp, kind="stable")
    times, reference, acceleration = series.stamp[order], states(series)[order], accelerations(series, "acceleration")[order]
    latest = np.maximum(np.searchsorted(times, stamps, side="right") - 1, 0)
    following = np.minimum(latest + 1, len(times) - 1)
    # A pause stops reference and ship, not the clock: extrapolated over it, the reference would be far away from where it waited.
    resumed = (stamps - times[latest] > PAUSE) & (np.abs(times[following] - stamps) < stamps - times[latest])
    latest = np.where(resumed, following, latest)
    rows: Array = reference[latest]
    # One by one and only where needed: in lockstep every reference has the stamp of its odometry.
    for row in np.flatnonzero(times[latest] != stamps):
        at = latest[row]
        rows[row] = extrapolate(
            as_motion(reference[at]), as_acceleration(acceleration[at]), seconds(int(stamps[row] - times[at]))
        )
    return rows


def seconds_of(nanoseconds: Any) -> Array:
    """Nanoseconds as seconds, bit-identical to `timing.seconds`."""
    return np.asarray(nanoseconds, np.float64) * 1e-9
