"""A bag as NumPy arrays, on any machine: `open_bag(path)`.

    from vessel_hsmc_ros.open_bag import open_bag

    bag = open_bag("runs/.../bag")            # complete, split, compressed, cut off: all the same
    bag.topics                                # by name: type, count, qos, fields
    odom = bag["odom"]                        # relative names find the one vessel's; else "/alpha/odom"
    odom["pose.pose.position.x"], odom.stamp  # (n,) float64, (n,) ns
    bag.load("odom", "reference")             # several topics in one pass over the bag
    bag.run()                                 # run_data.Run: time, state, reference, wrench, ...
    bag.scenario(), bag.parameters            # what the recording was made with

Nothing is read before it is asked for. A topic's first column brings its other narrow ones along; lists such as the
networks' weights or covariances are read when they are asked for themselves.
"""

import heapq
import struct
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from mcap.records import Channel

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.cdr_columns import Parts
from vessel_hsmc_ros.bags.files import bag_files, information, record_blocks
from vessel_hsmc_ros.bags.mcap_scan import Contents, message_places, read_contents
from vessel_hsmc_ros.bags.topic_columns import MESSAGE_HEADER, TIMES, Series
from vessel_hsmc_ros.bags.writer import PARAMETERS, RECORDING, SCENARIO
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import flat
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_sim_node.plant import Vessel

NEIGHBOURS = 4096
"""Messages that are looked at together to put them in the order of their log times."""

_HEADER = struct.Struct("<BQHIQQ")


class RawMessage(NamedTuple):
    """A message as it was recorded."""

    topic: str
    log_time: int
    publish_time: int
    data: bytes


def open_bag(path: Path | str) -> "Bag":
    """Open a bag: a rosbag2 folder of MCAP files, or one such file.

    Raises:
        BagError: there is no bag, or one that this package does not read.
    """
    return Bag(Path(path))


class Bag:
    """An opened bag; made by `open_bag`.

    Attributes:
        path: The folder or file.
        files: What each of its files holds.
        topics: Its topics by their full names.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.files: list[Contents] = [read_contents(file) for file in bag_files(path)]
        self.topics: dict[str, Series] = {}
        for contents in self.files:
            for channel in contents.channels.values():
                self._add(contents, channel)

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

    # -- what it says of itself ---------------------------------------------------------------------------------------

    @property
    def complete(self) -> bool:
        """Whether every file has its index; what was cut off does not, and is read all the same."""
        return all(contents.complete for contents in self.files)

    @property
    def count(self) -> int:
        """Messages."""
        return sum(series.count for series in self.topics.values())

    @property
    def start_time(self) -> int:
        """First log time, ns; 0 without messages."""
        return min((c.start_time for c in self.files if c.start_time is not None), default=0)

    @property
    def end_time(self) -> int:
        """Last log time, ns; 0 without messages."""
        return max((c.end_time for c in self.files), default=0)

    @cached_property
    def information(self) -> dict[str, Any]:
        """What metadata.yaml says; empty for a bare file."""
        return information(self.path) if self.path.is_dir() else {}

    @cached_property
    def recording(self) -> dict[str, str]:
        """What this package's recorder noted: `messages_dropped`, `version`, `mode` and more. Empty for other bags."""
        noted: dict[str, str] = dict(self.information.get("custom_data") or {})
        for contents in self.files:
            for _, _, record in contents.metadata:
                if record.name == RECORDING:
                    noted.update(record.metadata)
        return noted

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """The files that travel in the bag, the latest of each name."""
        return {a.name: a.data for contents in self.files for _, _, a in contents.attachments}

    @cached_property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """The parameters of every node while it was recorded, by the node's full name."""
        document = yaml.safe_load(self.attachments.get(PARAMETERS, b"")) or {}
        return {node: dict(flat(content["ros__parameters"])) for node, content in document.items()}

    @property
    def namespaces(self) -> list[str]:
        """The namespaces that hold a vessel's odometry: `/` or `/alpha/`."""
        return [name.removesuffix("odom") for name in self.topics if name.endswith("/odom")]

    def namespace(self, wanted: str | None = None) -> str:
        """One of the namespaces: the one that is asked for, without its slashes, or the only one.

        Raises:
            BagError: there is no such vessel, or several to choose from.
        """
        found = [name for name in self.namespaces if wanted is None or name.strip("/") == wanted.strip("/")]
        if not found:
            where = "" if wanted is None else f" in namespace /{wanted.strip('/')}"
            raise BagError(f"bag {self.path} has no odometry{where}: its topics are {', '.join(self.topics) or 'none'}")
        if len(found) > 1:
            raise BagError(f"bag {self.path} has several vessels, in the namespaces {', '.join(found)}: choose one")
        return found[0]

    def scenario(self, changes: dict[str, object] | None = None) -> Scenario:
        """The resolved scenario that the bag was recorded with, from the bag itself or from the params.yaml beside it.

        Args:
            changes: Values by `node.parameter` to put in place of the recorded ones.

        Raises:
            ScenarioError: there is none, or it cannot be read.
            ParameterError: a parameter is unknown or out of range.
        """
        name = self.recording.get("scenario") or self.path.absolute().parent.name
        if text := self.attachments.get(SCENARIO, b"").decode() or self._composed():
            return parse_scenario(text, name, changes)
        beside = self.path.absolute().parent / "params.yaml"
        if not beside.is_file():
            raise ScenarioError(f"bag {self.path} was recorded without its scenario, and {beside} does not exist")
        return load_scenario(beside, changes)

    def _composed(self) -> str:
        """A scenario from the parameters that the nodes themselves told; empty if one of them is missing."""
        found: dict[str, Any] = {}
        for name, values in self.parameters.items():
            node = name.rsplit("/", 1)[-1]
            if node in NODES and name.removesuffix(node) in (*self.namespaces, "/"):
                known = schema.entries(NODES[node])
                found[node] = {"ros__parameters": {key: value for key, value in values.items() if key in known}}
        return yaml.safe_dump(found) if found.keys() == NODES.keys() else ""

    # -- what is in it ------------------------------------------------------------------------------------------------

    def run(self, vessel: Vessel | None = None, namespace: str | None = None, weights: bool = True) -> Run:
        """The arrays of one vessel's run.

        Args:
            vessel: The plant's coefficients, which turn disturbing forces into accelerations; those of the bag's scenario if
                not given.
            namespace: The vessel's, where the bag has several.
            weights: Whether `control` has the networks' weights too, which are most of a bag.

        Raises:
            BagError: the bag lacks a topic that every run has.
            ScenarioError: the vessel is not given and the bag does not know it.
        """
        prefix = self.namespace(namespace)
        vessel = vessel or self.scenario().vessel_sim.vessel.coefficients()
        names = [name for name in run_from_bag.TOPICS if self.topics.get(prefix + name)]
        for name in run_from_bag.NEEDED:
            if name not in names:
                raise BagError(f"bag {self.path} has no message on {prefix}{name}")
        self.load(*(prefix + name for name in names))
        return run_from_bag.run({name: self.topics[prefix + name] for name in names}, vessel, weights)

    def load(self, *names: str) -> None:
        """Read the narrow columns of several topics, of all if none is named, in one pass over the bag."""
        chosen = [self[name] for name in names] if names else list(self.topics.values())
        self._read({series.name: series.missing(TIMES) for series in chosen})

    def messages(self, *names: str) -> Iterator[tuple[str, int, Any]]:
        """Topic, log time and message, with its fields as attributes, in order of log time within a chunk."""
        deserialize = {self[name].name: self[name].deserializer() for name in names or self.topics}
        for raw in self.raw_messages(*deserialize):
            yield raw.topic, raw.log_time, deserialize[raw.topic](raw.data)

    def raw_messages(self, *names: str) -> Iterator[RawMessage]:
        """Messages as they were recorded, in the order in which they were; all topics if none is named."""
        wanted = {self[name].name for name in names or self.topics}
        for contents, block in self._blocks():
            starts = message_places(block)
            lists = [[(s, i) for s in starts[i]] for i in starts if contents.channels[i].topic in wanted]
            for start, channel in heapq.merge(*lists):
                _, length, _, _, log_time, publish_time = _HEADER.unpack_from(block, start)
                data = block[start + MESSAGE_HEADER : start + 9 + length]
                yield RawMessage(contents.channels[channel].topic, log_time, publish_time, data)

    def ordered_messages(self, *names: str) -> Iterator[RawMessage]:
        """The same in the order of their log times, as far as a few thousand neighbours can be put in order."""
        waiting: list[tuple[int, int, RawMessage]] = []
        for number, message in enumerate(self.raw_messages(*names)):
            heapq.heappush(waiting, (message.log_time, number, message))
            if len(waiting) > NEIGHBOURS:
                yield heapq.heappop(waiting)[2]
        while waiting:
            yield heapq.heappop(waiting)[2]

    def _add(self, contents: Contents, channel: Channel) -> None:
        schema = contents.schemas.get(channel.schema_id)
        if channel.message_encoding != "cdr" or schema is None or schema.encoding != "ros2msg":
            raise BagError(f"{contents.path}: {channel.topic} is not a ROS 2 topic, cdr with a ros2msg schema")
        if channel.topic not in self.topics:
            qos = yaml.safe_load(channel.metadata.get("offered_qos_profiles", "")) or []
            hashed = channel.metadata.get("topic_type_hash", "")
            series = Series(channel.topic, schema.name, schema.data.decode(), hashed, qos, self._read_one)
            self.topics[channel.topic] = series
        self.topics[channel.topic].count += contents.counts[channel.id]

    def _read_one(self, series: Series, names: Sequence[str]) -> None:
        self._read({series.name: series.missing(names)})

    def _read(self, wanted: dict[str, list[str]]) -> None:
        """Fields of topics, in one pass."""
        wanted = {name: fields for name, fields in wanted.items() if fields}
        parts: dict[str, dict[str, Parts]] = {name: {f: Parts() for f in fields} for name, fields in wanted.items()}
        for contents, block in self._blocks() if wanted else ():
            for channel, starts in message_places(block).items():
                name = contents.channels[channel].topic
                if name in wanted:
                    fields = [field for field in wanted[name] if field not in TIMES]
                    for field, column in self.topics[name].take(block, starts, fields).items():
                        if field in parts[name]:
                            parts[name][field].append(column)
        for name in list(parts):
            self.topics[name].put(parts.pop(name))

    def _blocks(self) -> Iterable[tuple[Contents, bytes]]:
        for contents in self.files:
            for block in record_blocks(contents):
                yield contents, block
