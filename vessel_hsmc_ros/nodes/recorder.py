"""The recorder node: writes the serialised messages of its topics, into an MCAP bag, and the parameters of all nodes."""

import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from vessel_hsmc_ros.bags.writer import PARAMETERS, SCENARIO, BagWriter, Splitting, Topic, qos_entry
from vessel_hsmc_ros.core.exceptions import BagError, ParameterError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import raw
from vessel_hsmc_ros.messages.topics import FOREIGN_TOPICS, OPTIONAL_TOPICS, TYPES_OF_EVERY_NODE, definition
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.node_parameters import plain
from vessel_hsmc_ros.nodes.reporting import recording
from vessel_hsmc_ros.nodes.scheduling import run_in_batches
from vessel_hsmc_ros.scenario.parameters import RecorderParameters
from vessel_hsmc_ros.scenario.parameters_file import tree, yaml_text

if TYPE_CHECKING:
    from rclpy.client import Client


RETRY_AFTER = 8  # calls of `request` after which an unanswered request is sent again


class ParameterCollector:
    """Requests the parameters of every node that has parameter services.

    A request is repeated until it is answered: a server may answer before it has discovered the client's reader, and DDS then
    loses the response. `node`: owner of the service clients; its own parameters are read directly. `parameters`: by full node
    name, then by parameter.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        name = node.get_fully_qualified_name()
        self.parameters: dict[str, dict[str, Any]] = {
            name: {parameter.name: plain(parameter.value) for parameter in node.get_parameters_by_prefix("").values()}
        }
        self._requested = {name}
        self._tried: set[str] = set()
        self._clients: dict[str, list[Client]] = {}
        self._calls: dict[str, int] = {}
        self._reported = 0

    def request(self, again: bool = True) -> None:
        """Send requests to nodes that were discovered since the last call; call it periodically."""
        there = {f"{space.rstrip('/')}/{name}": (name, space) for name, space in self._node.get_node_names_and_namespaces()}
        # Clients of nodes that have answered or left are not needed any more.
        for name in [name for name in self._clients if name in self.parameters or name not in there]:
            self._destroy_clients(name)
        for name in list(self._clients):
            self._calls[name] += again
            if again and self._calls[name] % RETRY_AFTER == 0:
                self._destroy_clients(name)
                self._requested.discard(name)
        for full, (name, space) in there.items():
            # An underscore marks a hidden node.
            if full not in self._requested and not name.startswith("_") and self._may_answer(full, name, space):
                self._request(full)

    def _may_answer(self, full: str, name: str, namespace: str) -> bool:
        """Whether a node is new, or offers its parameters by the graph: a client costs every process some memory until it ends.

        The clients of the first try prepare the others: a node's answer waits until it has discovered the client.
        """
        if full not in self._tried:
            self._tried.add(full)
            return True
        try:
            services = dict(self._node.get_service_names_and_types_by_node(name, namespace))
        except NodeNameNonExistentError:  # it has left
            return False
        return all(f"{full}/{service}" in services for service in ("list_parameters", "get_parameters"))

    def new_document(self) -> str | None:
        """All parameters as a ROS parameters file; None if no node was added since the last call, or more are on their way.

        A node whose first request was not answered delays the others no longer.
        """
        if len(self.parameters) == self._reported or any(self._calls[name] < RETRY_AFTER for name in self._clients):
            return None
        self._reported = len(self.parameters)
        document = {name: {"ros__parameters": tree(self.parameters[name])} for name in sorted(self.parameters)}
        return yaml_text(document)

    def _request(self, name: str) -> None:
        lister = self._node.create_client(ListParameters, f"{name}/list_parameters")
        getter = self._node.create_client(GetParameters, f"{name}/get_parameters")
        if not (lister.service_is_ready() and getter.service_is_ready()):  # not connected yet
            self._node.destroy_client(lister)
            self._node.destroy_client(getter)
            return
        self._requested.add(name)
        self._clients[name] = [lister, getter]
        self._calls.setdefault(name, 0)

        # Chained callbacks: waiting for an answer here would deadlock the executor that delivers it.
        def on_names(future: Future) -> None:
            names = list(future.result().result.names)
            self._get(name, getter, names, len(names), {})

        lister.call_async(ListParameters.Request()).add_done_callback(on_names)

    def _get(self, node: str, getter: "Client", names: list[str], count: int, found: dict[str, Any]) -> None:
        """Get the values of parameters, some at a time, beside those that were found before.

        A node answers with fewer values than requested, with none in rclpy, where one was declared without a value or has been
        removed since: then they are requested one at a time. An answer that comes after its request was repeated is not needed.
        """
        if getter not in self._clients.get(node, ()):
            return
        if not names:
            self.parameters[node] = found
            return
        requested, left = names[:count], names[count:]

        def on_values(future: Future) -> None:
            self._calls[node] = 0  # it answers: its request is not sent again meanwhile
            values = [plain(parameter_value_to_python(value)) for value in future.result().values]
            if len(values) < count and count > 1:
                self._get(node, getter, names, 1, found)
                return
            found.update({key: value for key, value in zip(requested, values, strict=False) if value is not None})
            self._get(node, getter, left, count, found)

        getter.call_async(GetParameters.Request(names=requested)).add_done_callback(on_values)

    def _destroy_clients(self, name: str) -> None:
        for client in self._clients.pop(name):
            self._node.destroy_client(client)


@dataclass
class TopicChoice:
    """Selects topics by name, by regular expression, or all except hidden ones (with a token that starts with an underscore).

    `names`: full names of topics. `regex`: select topics whose full name matches it; empty for none. `exclude`: regular
    expression of topics that `everything` and `regex` do not select; empty for none.
    """

    names: Sequence[str]
    everything: bool = False
    regex: str = ""
    exclude: str = ""
    _taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name in ("regex", "exclude"):
            try:
                re.compile(getattr(self, name))
            except re.error as error:
                text = getattr(self, name)
                raise ParameterError(f"recorder.{name} must be a regular expression (got {text}: {error})") from None

    @property
    def open_ended(self) -> bool:
        """Whether topics are selected whose names are not known in advance."""
        return self.everything or bool(self.regex)

    @property
    def missing(self) -> list[str]:
        """The named topics that are not subscribed to yet."""
        return [name for name in self.names if name not in self._taken]

    def wants(self, name: str) -> bool:
        """Whether a topic is selected, regardless of whether it is subscribed to."""
        if name in self.names:  # a name takes precedence over `exclude` and over being hidden
            return True
        if "/_" in name or (self.exclude and re.fullmatch(self.exclude, name)):
            return False
        return self.everything or bool(self.regex and re.fullmatch(self.regex, name))

    def new(self, present: Iterable[str]) -> list[str]:
        """The selected topics among those present that are not subscribed to yet."""
        return [name for name in present if name not in self._taken and self.wants(name)]

    def take(self, name: str) -> None:
        """Mark a topic as subscribed to: `new` does not return it again."""
        self._taken.add(name)


FLUSH_PERIOD, METADATA_PERIOD = 0.25, 5.0
"""Time between two flushes of recorded messages to the operating system, and between two updates of metadata.yaml, s."""

BEGINNING = ("odom", "reference", "controller/state")
"""In real time, the recorder of a run subscribes to nothing before every vessel has these. The nodes of a run wait for it, so
that none begins while the processes of others still start, which takes all cores."""

PARAMETERS_LIMIT = 5.0
"""Longest time for which the recorder of a run waits for the parameters of the nodes before it subscribes to their topics, s: a
short run on a busy machine would end before they have answered."""

DRAIN_LOOKS, DRAIN_LIMIT = 3, 3.0
"""On shutdown, the recorder continues until so many consecutive polls bring no message, but at most for this time, s."""


class RecorderNode(VesselNode):
    """Subscribes to each topic when its first publisher appears, takes the serialized messages in batches and writes them.

    The log time of a message is its own stamp in lockstep, the simulated time of its receipt with `use_sim_time`, else the time
    of its receipt.
    """

    NAME = "recorder"
    INTERFACE = """
        subscribes to  <topics> (of the parameters topics, all_topics and regex, which it writes into a bag),
                       thrusters/<name>/thrust, watched_wrench
        calls          */list_parameters, */get_parameters (of each node)
    """
    PARAMETERS = RecorderParameters
    POLL_PERIOD = 0.05

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._choice = TopicChoice([self.resolve_topic_name(t) for t in p.topics], p.all_topics, p.regex, p.exclude)
        scenario = _scenario(p.scenario_file)
        notes = {"mode": "lockstep" if p.lockstep else "real time", "scenario": p.scenario}
        notes |= {"law_source": p.law_source} if p.law_source else {}
        self._writer = BagWriter(Path(p.directory), p.compression, Splitting(p.split_size, p.split_duration), notes)
        if scenario:
            self._writer.attach(SCENARIO, scenario)
        self._sim_time = not p.lockstep and self.get_parameter("use_sim_time").value
        self._foreign = self._topics_named(FOREIGN_TOPICS)
        self._awaited = self._topics_named(BEGINNING) & set(self._choice.names) if p.recorded and not p.lockstep else set()
        self._dropped = self._waited = 0
        self._before: dict[str, int] = {}
        self._collector = ParameterCollector(self)
        self._publishing: set[str] = set()
        self._parameters_until = time.monotonic() + PARAMETERS_LIMIT if p.recorded else 0.0
        self._discovery = self.create_timer(0.02, self._discover, clock=self.wall)
        self.create_timer(FLUSH_PERIOD, self._flush, clock=self.wall)
        self.create_timer(METADATA_PERIOD, self._update_metadata, clock=self.wall)

    def describe(self) -> str:
        """Where the bag is written."""
        return f"recording into {self._writer.directory}"

    def _topics_named(self, names: Iterable[str]) -> set[str]:
        """The recorded topics of some names, in the namespace of the recorder and in those of a fleet's vessels."""
        own = {self.resolve_topic_name(name) for name in names}
        return own | {topic for topic in self._choice.names if topic.endswith(tuple(f"/{name}" for name in names))}

    # -- topics -------------------------------------------------------------------------------------------------------

    def _discover(self) -> None:
        if self._sim_time and not self.now():
            return  # before the first /clock there is no log time
        self._awaited = {name for name in self._awaited if not self.count_publishers(name)}
        if self._awaited:
            return
        present = self._choice.missing
        if self._choice.open_ended:
            present = [name for name, _ in self.get_topic_names_and_types()]
        for name in self._choice.new(present):
            ends = self.get_publishers_info_by_topic(name) or self._readers_of_foreign(name)
            if ends and not self._waits_for_parameters(name, ends):
                self._choice.take(name)
                self._subscribe(name, ends)
        if not (self._choice.missing or self._choice.open_ended):
            self.destroy_timer(self._discovery)

    def _readers_of_foreign(self, name: str) -> list[Any]:
        """Subscribers of a topic that other programs publish: they reveal its type before a short-lived publisher appears."""
        return self.get_subscriptions_info_by_topic(name) if name in self._foreign else []

    def _waits_for_parameters(self, name: str, publishers: list[Any]) -> bool:
        """Whether parameters of the nodes that publish a topic are awaited; they begin once it is subscribed to."""
        if name in self._foreign or publishers[0].topic_type in TYPES_OF_EVERY_NODE:
            return False
        nodes = {f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in publishers}
        self._publishing |= nodes
        if nodes <= self._collector.parameters.keys() or time.monotonic() > self._parameters_until:
            return False
        self._collector.request(again=False)
        return True

    def _subscribe(self, name: str, publishers: list[Any]) -> None:
        """Subscribe to a topic with the strongest profile that all its publishers offer, and add it to the bag."""
        kinds = sorted({info.topic_type for info in publishers})
        if len(kinds) > 1:
            self.get_logger().warning(f"{name} has publishers of {', '.join(kinds)}: it is not recorded")
            return
        try:
            topic = Topic(name, kinds[0], definition(kinds[0]), str(publishers[0].topic_type_hash), _offered(publishers))
            kind = raw.message_class(kinds[0])
        except (BagError, ImportError, AttributeError) as error:  # the last: of a package of another version
            self.get_logger().warning(f"{name} is not recorded: {error}")
            return
        profile = qos.recorded([info.qos_profile for info in publishers])
        if len({(i.qos_profile.reliability, i.qos_profile.durability) for i in publishers}) > 1:
            chosen = f"recorded as {_in_words(profile)}, which all of them offer"
            self.get_logger().warning(f"{name} is offered in different qualities of service: {chosen}")
        self._writer.add_topic(topic)
        callback = self._recorder_of(topic, kind, alone=len(publishers) == 1)
        self.direct_subscriptions.append(self.create_subscription(kind, name, callback, profile, raw=True))

    def _recorder_of(self, topic: Topic, kind: Any, alone: bool) -> Any:
        """The callback of a topic; if the topic has one publisher, a gap in its sequence numbers counts as dropped messages.

        With the parameter `recorded` the publishers wait for the recorder, so that their first message counts too. Otherwise
        messages published before the recorder subscribed are not counted as dropped, but named on the log.
        """
        p, of_a_vessel = self.parameters, topic.kind not in TYPES_OF_EVERY_NODE and topic.name not in self._foreign
        stamped = of_a_vessel and raw.begins_with_stamp(kind)
        numbered = of_a_vessel and alone
        expected = 1 if p.recorded else 0  # DDS numbers messages from 1; 0 accepts any first number
        lockstep, sim_time, writer = p.lockstep, self._sim_time, self._writer

        def record(data: bytes, info: dict[str, int]) -> None:
            nonlocal expected, numbered
            self._waited = max(self._waited, time.time_ns() - info["received_timestamp"])
            if numbered:
                number = info["publication_sequence_number"]
                if number > expected > 0:
                    self._dropped += number - expected
                if not expected and number > 1:
                    self._before[topic.name] = number - 1
                numbered = number >= expected  # a lower one is of another publisher: from there on gaps have no meaning
                expected = number + 1
            if lockstep:
                if stamped:  # messages without a stamp get that of the latest one that has one
                    self.stamp = raw.stamp(data)
                received = sent = self.stamp
            else:
                received = self.now() if sim_time else info["received_timestamp"]
                sent = info["source_timestamp"]
            writer.write(topic, data, received, sent)

        return record

    # -- periodic work ------------------------------------------------------------------------------------------------

    def on_own_process(self) -> None:
        """Give way to the other nodes; in lockstep they wait for the recorder."""
        run_in_batches()

    def _flush(self) -> None:
        if self._before:
            missed = ", ".join(f"{count} of {name}" for name, count in self._before.items())
            self.get_logger().warning(f"joined late: messages published before are not in the bag: {missed}")
            notes = self._writer.notes
            notes["joined_late"] = ", ".join(filter(None, (notes.get("joined_late"), missed)))
            self._before.clear()
        self._collector.request()
        if (document := self._collector.new_document()) is not None:
            self._writer.attach(PARAMETERS, document)
        self._writer.flush()

    def _update_metadata(self) -> None:
        """Bring metadata.yaml up to date, so that the bag of a recorder that is killed can be read."""
        self._note()
        self._writer.flush_metadata()

    def _note(self) -> None:
        self._writer.notes["messages_dropped"] = str(self._dropped)

    # -- shutdown -----------------------------------------------------------------------------------------------------

    def spin(self, running: Any) -> None:
        """Record until a signal requests the shutdown, then until no more messages arrive, then its own final status."""
        super().spin(running)
        self._drain()
        self.publish_diagnostics()
        self._drain()

    def _drain(self) -> None:
        """Record messages that are still in transit.

        Polls are counted instead of time: a process that was not scheduled for a while must still poll its queues.
        """
        end = time.monotonic() + DRAIN_LIMIT
        count, looks = -1, 0

        def running() -> bool:
            nonlocal count, looks
            looks = looks + 1 if self._writer.message_count == count else 0
            count = self._writer.message_count
            return looks < DRAIN_LOOKS and time.monotonic() < end

        super().spin(running)

    def close(self) -> None:
        """Complete the bag."""
        self._note()
        if missing := ", ".join(sorted(self._publishing - self._collector.parameters.keys())):
            self._writer.notes["parameters_missing"] = missing
            self.get_logger().warning(f"the bag lacks the parameters of {missing}: no answer came")
        try:
            self._writer.close()
            count, name = self._writer.message_count, self._writer.directory
            self.get_logger().info(f"recorded {count} messages, {self._dropped} dropped, into {name}")
        finally:
            super().close()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Number of recorded and of dropped messages, and the topics that have no publisher yet."""
        optional = self._topics_named(OPTIONAL_TOPICS)
        if not (self.parameters.lockstep or self._sim_time):
            optional.add("/clock")  # in real time no node has to publish it
        missing = [topic for topic in self._choice.missing if topic not in optional]
        values = {"messages": self._writer.message_count, "dropped": self._dropped, "missing": ", ".join(missing)}
        if self._dropped:
            return WARN, f"{self._dropped} messages were lost", values
        return OK, f"recording; waiting for {', '.join(missing)}" if missing else "recording", values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """Queue, disk space and gaps besides the status."""
        waited, self._waited = self._waited, 0
        return [*super().diagnostic_tasks(), *recording(self._writer.directory, waited / NANOSECONDS, self._dropped)]


def _scenario(path: str) -> str:
    """The text of a parameters file; empty for none. Raises BagError if it cannot be read."""
    try:
        return Path(path).read_text(encoding="utf-8") if path else ""
    except (OSError, UnicodeDecodeError) as error:
        raise BagError(f"recorder.scenario_file = {path} cannot be read: {error}") from None


def _offered(publishers: list[Any]) -> list[dict[str, Any]]:
    """The publishers' profiles as far as discovery knows them, in the form of rosbag2's metadata."""
    entries = []
    for offered in (info.qos_profile for info in publishers):
        times = {name: getattr(offered, name).nanoseconds for name in ("deadline", "lifespan", "liveliness_lease_duration")}
        # rclpy gives an infinite duration as 0 or as almost 2**63.
        spans = {name: divmod(span, NANOSECONDS) for name, span in times.items() if 0 < span < 2**62}
        manual = offered.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
        entries.append(qos_entry(*_qualities(offered), liveliness="manual_by_topic" if manual else "automatic", **spans))
    return entries


def _qualities(profile: QoSProfile) -> tuple[bool, bool]:
    latched = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    return profile.reliability is ReliabilityPolicy.RELIABLE, latched


def _in_words(profile: QoSProfile) -> str:
    reliable, latched = _qualities(profile)
    return f"{'reliable' if reliable else 'best effort'}, {'transient local' if latched else 'volatile'}"
