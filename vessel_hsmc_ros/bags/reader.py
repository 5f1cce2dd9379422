"""A bag as NumPy arrays, on any machine: `open_bag(path)`.

    from vessel_hsmc_ros import open_bag

    bag = open_bag("runs/.../bag")            # complete, split, compressed or cut off
    bag.topics                                # by name: type, count, qos, fields
    odom = bag["odom"]                        # relative names find the one vessel's; else "/alpha/odom"
    odom["pose.pose.position.x"], odom.stamp  # (n,) float64, (n,) ns
    bag.load("odom", "reference")             # several topics in one pass over the bag
    bag.run()                                 # core.metrics.Run: time, state, reference, wrench, ...
    bag.scenario(), bag.parameters            # the scenario and the parameters of the recording
    bag.diagnostics()                         # the last diagnostics of each node
    bag.events()                              # services called, parameters changed, goals accepted, with their times

Columns are read when they are first used. A topic's first column brings its other narrow ones along; lists such as the
networks' weights or covariances are read only when they are used themselves.
"""

import heapq
import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.files import BagFiles, RawMessage, bag_path
from vessel_hsmc_ros.bags.rosbag2_metadata import offered_qos
from vessel_hsmc_ros.bags.topic_columns import Series, load_columns
from vessel_hsmc_ros.bags.writer import PARAMETERS, RECORDING, SCENARIO
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.node_list import ALLOCATION
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages.conversions import read_status
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.plant.dynamics import Vessel
from vessel_hsmc_ros.scenario.parameters import NODES, declared, read_parameters
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters, flat, read_yaml, yaml_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario, scenario_text

Parameters = Mapping[str, Mapping[str, Any]]


def recorded_parameters(text: bytes) -> dict[str, dict[str, Any]]:
    """The parameters of every node by its full name, from a bag's attachment.

    Raises ScenarioError if the attachment is not a ROS parameters file.
    """
    try:
        document = read_yaml(text.decode()) or {}
        return {str(node): flat(content["ros__parameters"]) for node, content in document.items()}
    except (yaml.YAMLError, ParameterError, UnicodeDecodeError, AttributeError, KeyError, TypeError) as error:
        raise ScenarioError(f"the parameters in the bag cannot be read: {error}") from None


def recorded_scenario(
    bag: Path,
    name: str,
    text: str,
    parameters: Parameters,
    namespaces: Collection[str],
    changes: dict[str, object] | None,
    any_law: bool = False,
    namespace: str | None = None,
) -> Scenario:
    """The scenario of a bag, from the first of three sources that it has.

    Args:
        bag: The bag's path; the last source is a params.yaml beside it.
        text: The scenario attached to the bag; empty if there is none. The first source.
        parameters: The recorded parameters of every node, by its full name. The second source.
        changes: Values by `node.parameter` that replace the recorded ones.
        any_law: Accept a law whose code is not known here, without its parameters.

    Raises:
        ScenarioError: there is none, or it cannot be read.
        ParameterError: a parameter is unknown or out of range.
    """
    if text := text or _from_parameters(parameters, [namespace] if namespace else namespaces):
        return _with_any_law(text, name, namespace) if any_law else parse_scenario(text, name, changes, namespace=namespace)
    beside = bag.absolute().parent / "params.yaml"
    if not beside.is_file():
        raise ScenarioError(
            f"bag {bag} was recorded without its scenario, and {beside} does not exist: recorder.scenario_file stores it"
        )
    text = scenario_text(beside)
    return parse_scenario(text, beside.stem, changes, f"scenario file {beside}", beside.parent, namespace)


def _with_any_law(text: str, name: str, namespace: str | None) -> Scenario:
    """A scenario for the evaluation of a run, which needs the name of its law but not its code."""
    values = read_parameters(text, declared(), "the bag's scenario", namespace)
    controller = values["controller"]
    law = controller.get("law")
    if not isinstance(law, str) or law in LAWS:
        return parse_scenario(text, name, namespace=namespace)
    # A stand-in that is valid at every rate takes the place of the law, while the other parameters are checked.
    values["controller"] = {key: value for key, value in controller.items() if not key.startswith(f"{law}.")} | {"law": "pd"}
    scenario = parse_scenario(dump_parameters(values), name)
    return replace(scenario, controller=replace(scenario.controller, law=law))


def _from_parameters(parameters: Parameters, namespaces: Collection[str]) -> str:
    """A scenario made of the nodes' own parameters; empty if the parameters of a node are missing."""
    found: dict[str, Any] = {}
    for name, values in parameters.items():
        node = name.rsplit("/", 1)[-1]
        if node in NODES and name.removesuffix(node) in (*namespaces, "/"):
            # ROS adds parameters of its own, such as use_sim_time, which a scenario does not have.
            known = schema.entries(NODES[node])
            found[node] = {"ros__parameters": {key: value for key, value in values.items() if key in known}}
    return yaml_text(found) if found.keys() >= NODES.keys() - {ALLOCATION} else ""


class Event(NamedTuple):
    """Something that happened to a node."""

    time: float  # since the first odometry message, as in `Run.time`, s. In lockstep, of the step after which it took effect
    node: str  # name of the node, without its namespace
    kind: str  # `pause`, `resume`, `reset`, `enable`, `disable`, `parameter`, `goal`, `path` or `fault`
    text: str  # details; of a parameter its full name, old and new value: `controller.guided.position_gain: 0.3 -> 0.5`


class VesselRecord(NamedTuple):
    """What a bag has of one vessel."""

    topics: run_from_bag.Topics  # its topics with messages, of `run_from_bag.TOPICS`, by their names without its namespace
    run: Run
    start: int  # stamp at which the time of the run is zero, ns
    events: list[Event]  # as `Bag.events`


def changed_parameters(events: Iterable[Event]) -> dict[str, object]:
    """The new values of the parameters that events changed, by `node.parameter`."""
    changes: dict[str, object] = {}
    for event in events:
        if event.kind == "parameter":
            name, _, values = event.text.partition(": ")
            try:
                changes[name] = read_yaml(values.partition(" -> ")[2])
            except yaml.YAMLError as error:
                raise BagError(f"event {event.text} cannot be read: {error}") from None
    return changes


NEIGHBOURS = 4096  # size of the window, in messages, within which messages are sorted by log time

__all__ = ["Bag", "Event", "RawMessage", "Series", "open_bag"]


def open_bag(path: Path | str, odometry: str = "", wrench: str = "") -> "Bag":
    """Open a bag: a rosbag2 folder of MCAP files, one such file, or a run folder with a bag.

    Args:
        path: The bag.
        odometry, wrench: Topics of the odometry and of the wrench on the hull, where they are not found by name or type.

    Raises:
        BagError: the path is not a bag, or is a bag of a kind that this package does not read, or has no such topic.
    """
    return Bag(bag_path(Path(path)), {"odom": odometry, "applied_wrench": wrench})


class Bag(run_from_bag.VesselTopics):
    """An opened bag; made by `open_bag`.

    Attributes:
        path: The folder or file.
        files: The contents of each of its files.
        missing: Names of files that metadata.yaml has, and the folder has not.
        topics: Its topics by their full names.
    """

    def __init__(self, path: Path, given: Mapping[str, str] | None = None) -> None:
        self._source = BagFiles(path)
        self.files = self._source.contents
        self.missing = self._source.missing
        super().__init__(path, _topics_of(self._source), {own: name for own, name in (given or {}).items() if name})

    def __getitem__(self, name: str) -> Series:
        """A topic by its full name, or by the end of its name if only one topic ends so.

        Raises:
            BagError: there is none, or more than one.
        """
        if name in self.topics:
            return self.topics[name]
        found = [topic for topic in self.topics if topic.endswith(f"/{name}")]
        nearest = [topic for topic in found if topic.count("/") == min(other.count("/") for other in found)]
        if len(nearest) != 1:
            has = ", ".join(nearest or self.topics) or "none"
            raise BagError(f"bag {self.path} has {len(nearest)} topics named {name}: it has {has}")
        return self.topics[nearest[0]]

    # -- description --------------------------------------------------------------------------------------------------

    @property
    def complete(self) -> bool:
        """Whether every file is there and was closed. A file that was cut off is read up to where it breaks off."""
        return all(contents.complete for contents in self.files) and not self.missing

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(series.count for series in self.topics.values())

    @property
    def start_time(self) -> int:
        """First log time, ns; 0 without messages."""
        return min((c.start_time for c in self.files if c.start_time is not None), default=0)

    @property
    def end_time(self) -> int:
        """Last log time, ns; 0 without messages."""
        return max((c.end_time for c in self.files), default=0)

    @property
    def information(self) -> dict[str, Any]:
        """The content of metadata.yaml; empty for a bare file."""
        return self._source.information

    @cached_property
    def recording(self) -> dict[str, str]:
        """Facts on the recording by this package's recorder; empty for other bags.

        Among others `mode`, `scenario`, `messages_dropped`, and the versions that computed it: `version` (of this package),
        `numpy` and `python`, as far as the recorder wrote them.
        """
        notes: dict[str, str] = {}
        for contents in self.files:
            for _, _, record in contents.metadata:
                if record.name == RECORDING:
                    notes.update(record.metadata)
        # A file has the notes of its beginning, until it is complete; metadata.yaml is brought up to date in between.
        return notes | dict(self.information.get("custom_data") or {})

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """The attached files by name, the latest of each."""
        return {a.name: a.data for contents in self.files for _, _, a in contents.attachments}

    @cached_property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """The parameters of every node during the recording, by the node's full name."""
        return recorded_parameters(self.attachments.get(PARAMETERS, b""))

    def twist_frame(self, prefix: str) -> str:
        """The frame in which the controller of a namespace took the velocities of its odometry: child, or parent, the pose's."""
        with suppress(ScenarioError):  # of a damaged attachment, which costs its readers no more than the parameters
            return str(self.parameters.get(f"{prefix}controller", {}).get("odometry.twist_frame", "child"))
        return "child"

    def scenario(
        self,
        changes: dict[str, object] | None = None,
        at: float = -math.inf,
        any_law: bool = False,
        namespace: str | None = None,
    ) -> Scenario:
        """The resolved scenario of the recording: attached to the bag, from the nodes' parameters, or from params.yaml beside it.

        Args:
            changes: Values by `node.parameter` that replace the recorded ones.
            at: A time as in `events`, s: parameters that were changed until then have their new values. At the start by default.
            any_law: Accept a law whose code is not known here, for an evaluation that only needs its name: without changes.
            namespace: The vessel's, where the bag has several.

        Raises:
            ScenarioError: there is none, or it cannot be read.
            ParameterError: a parameter is unknown or out of range.
        """
        name = self.recording.get("scenario") or self.path.absolute().parent.name
        text = self.attachments.get(SCENARIO, b"").decode(errors="replace")
        live = changed_parameters(event for event in self.events(namespace) if event.time <= at) if at > -math.inf else {}
        changed = {**live, **(changes or {})}
        return recorded_scenario(self.path, name, text, self.parameters, self.namespaces, changed, any_law, namespace)

    def events(self, namespace: str | None = None) -> list[Event]:
        """The events of one vessel: services called, parameters changed while the nodes ran, goals and paths accepted.

        A bag that was recorded without the topic `events` has none.

        The arguments and exceptions are those of `diagnostics`.
        """
        prefix = self.namespace(namespace)
        events, odometry = self.find(prefix, EVENTS), self.find(prefix, "odom")
        if events is None:
            return []
        start = int(odometry.stamp.min()) if odometry is not None else self.start_time
        columns = (events.stamp - start, *(events[name] for name in ("node", "kind", "text")))
        found = [Event(seconds(time), *texts) for time, *texts in zip(*(each.tolist() for each in columns), strict=True)]
        return sorted(found, key=lambda event: event.time)

    def diagnostics(self, namespace: str | None = None) -> dict[str, dict[str, str]]:
        """The last diagnostics of each node of one vessel: values by name, `message` among them.

        Args:
            namespace: The vessel's, where the bag has several.

        Raises:
            BagError: there is no such vessel, or there are several to choose from.
        """
        prefix = self.namespace(namespace)
        status: dict[str, dict[str, str]] = {}
        for statuses in self["/diagnostics"]["status"] if self.readable("/diagnostics") else ():
            status.update(read_status(statuses, prefix[1:]))
        return status

    # -- messages -----------------------------------------------------------------------------------------------------

    def run(self, vessel: Vessel | None = None, namespace: str | None = None, weights: bool = True) -> Run:
        """The arrays of one vessel's run: of a bag of another recorder or of a real boat, what it has; the rest is NaN.

        Args:
            vessel: The plant's coefficients, which convert the recorded disturbance from forces to accelerations; those of the
                bag's scenario if not given.
            namespace: The vessel's, where the bag has several.
            weights: Whether `control` includes the networks' weights, which are most of a bag's bytes.

        Raises:
            BagError: there is no odometry of the vessel.
        """
        prefix = self.namespace(namespace)
        if vessel is None:
            with suppress(ScenarioError):  # of a real boat
                vessel = self.scenario(any_law=True, namespace=prefix).vessel_sim.vessel.coefficients()
        return self._run(self._of_vessel(prefix), vessel, weights, prefix)

    def record(self, prefix: str, vessel: Vessel | None) -> VesselRecord:
        """All that a report takes of one vessel, without the networks' weights; of another recorder's bag, what it has.

        Args:
            prefix: The vessel's namespace, with its slashes.
            vessel: As in `run`; None where it is not known.

        Raises:
            BagError: there is no odometry of the vessel.
        """
        topics = self._of_vessel(prefix)
        run, start = self._run(topics, vessel, False, prefix), int(topics["odom"].stamp.min())
        if vessel and all(name in topics for name in run_from_bag.NEEDED):
            start = run_from_bag.first_row(topics)
        return VesselRecord(topics, run, start, self.events(prefix))

    def _run(self, topics: run_from_bag.Topics, vessel: Vessel | None, weights: bool, prefix: str) -> Run:
        if vessel and all(name in topics for name in run_from_bag.NEEDED):
            return run_from_bag.run(topics, vessel, weights, self.twist_frame(prefix))
        return run_from_bag.partial_run(topics, self.twist_frame(prefix))

    def _of_vessel(self, prefix: str) -> dict[str, Series]:
        """The topics of a vessel that have messages, with their narrow columns."""
        found = {name: series for name in run_from_bag.TOPICS if (series := self.find(prefix, name)) is not None}
        if "odom" not in found:
            reason = f" to decode: it {series.undecodable}" if (series := self.topics.get(f"{prefix}odom")) else ""
            raise BagError(f"bag {self.path} has no message on {prefix}odom{reason}")
        load_columns(found.values())
        return found

    def load(self, *names: str) -> None:
        """Read the narrow columns of several topics, of all that can be decoded if none is given, in one pass over the bag."""
        load_columns([self[name] for name in names or self.topics if names or not self.topics[name].undecodable])

    def messages(self, *names: str) -> Iterator[tuple[str, int, Any]]:
        """Topic, log time and deserialised message, in the recorded order; all topics that can be decoded if none is given."""
        chosen = names or [name for name in self.topics if self.readable(name)]
        for raw in self.raw_messages(*chosen) if chosen else ():
            yield raw.topic, raw.log_time, self.topics[raw.topic].deserialize(raw.data)

    def raw_messages(self, *names: str) -> Iterator[RawMessage]:
        """Serialised messages in the recorded order; all topics if none is given."""
        return self._source.raw_messages({self[name].name for name in names or self.topics})

    def ordered_messages(self, *names: str) -> Iterator[RawMessage]:
        """Serialised messages in the order of their log times; all topics if none is given.

        A message that was recorded more than NEIGHBOURS messages late stays out of order.
        """
        waiting: list[tuple[int, int, RawMessage]] = []
        # The number keeps messages of equal time in the recorded order, and messages themselves from being compared.
        for number, message in enumerate(self.raw_messages(*names)):
            heapq.heappush(waiting, (message.log_time, number, message))
            if len(waiting) > NEIGHBOURS:
                yield heapq.heappop(waiting)[2]
        while waiting:
            yield heapq.heappop(waiting)[2]


class _Channel(NamedTuple):
    """A channel of one file: name of its type and encoding of its messages, and what else is known of it."""

    kind: tuple[str, str]
    definition: str
    type_hash: str
    qos: list[dict[str, Any]]
    messages: int


def _topics_of(files: BagFiles) -> dict[str, Series]:
    """The topics of a bag by their full names; those of other programs than ROS 2 too, whose messages are only passed on."""
    found: dict[str, list[_Channel]] = {}
    for contents in files.contents:
        for channel in contents.channels.values():
            schema = contents.schemas.get(channel.schema_id)
            known = schema is not None and schema.encoding == "ros2msg"
            text = schema.data.decode(errors="replace") if schema and known else ""
            kind, type_hash = schema.name if schema else "", channel.metadata.get("topic_type_hash", "")
            made = _Channel((kind, channel.message_encoding), text, type_hash, offered_qos(channel), contents.counts[channel.id])
            found.setdefault(channel.topic, []).append(made)
    return {name: _series(name, channels, files) for name, channels in found.items()}


def _series(name: str, channels: Sequence[_Channel], files: BagFiles) -> Series:
    """A topic of one or several channels: of those of several types, the type with the most messages."""
    counts: Counter[tuple[str, str]] = Counter()
    for channel in channels:
        counts[channel.kind] += channel.messages
    (kind, encoding), _ = counts.most_common(1)[0]
    alike = [channel for channel in channels if channel.kind == (kind, encoding)]
    definition = next((channel.definition for channel in alike if channel.definition), "")
    others = [f"{found[0] or 'no type'} in {found[1]} ({n})" for found, n in counts.items() if n and found != (kind, encoding)]
    first = alike[0]
    return Series(name, kind, definition, first.type_hash, first.qos, files, counts.total(), encoding, ", ".join(others))
