"""The parameters of all nodes, requested once from each node that appears."""

import array
from typing import TYPE_CHECKING, Any

import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

from vessel_hsmc_ros.scenario.parameters_file import tree

if TYPE_CHECKING:
    from rclpy.client import Client


DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
"""The parameters of a fleet are thousands of lines, which LibYAML writes ten times as fast, where it is installed."""

RETRY_AFTER = 8  # calls of `request` after which an unanswered request is sent again


class ParameterCollector:
    """Requests the parameters of every node that has parameter services.

    A request is repeated until it is answered: a server may answer before it has discovered the client's reader, and DDS then
    loses the response. `node`: owner of the service clients; its own parameters are read directly.

    Attributes:
        parameters: By full node name, then by parameter.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        name = node.get_fully_qualified_name()
        self.parameters: dict[str, dict[str, Any]] = {
            name: {parameter.name: _plain(parameter.value) for parameter in node.get_parameters_by_prefix("").values()}
        }
        self._requested = {name}
        self._tried: set[str] = set()
        self._clients: dict[str, list[Client]] = {}
        self._calls: dict[str, int] = {}
        self._reported = 0

    def request(self, again: bool = True) -> None:
        """Send requests to nodes that were discovered since the last call; call it periodically.

        `again`: whether the call counts for the repetition of requests.
        """
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
        text: str = yaml.dump(document, Dumper=DUMPER, sort_keys=False)
        return text

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
            values = [_plain(parameter_value_to_python(value)) for value in future.result().values]
            if len(values) < count and count > 1:
                self._get(node, getter, names, 1, found)
                return
            found.update({key: value for key, value in zip(requested, values, strict=False) if value is not None})
            self._get(node, getter, left, count, found)

        getter.call_async(GetParameters.Request(names=requested)).add_done_callback(on_values)

    def _destroy_clients(self, name: str) -> None:
        for client in self._clients.pop(name):
            self._node.destroy_client(client)


def _plain(value: Any) -> Any:
    """A parameter's value in Python's own types."""
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, array.array | list | tuple):
        return [_plain(item) for item in value]
    return value
