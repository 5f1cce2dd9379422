"""The collection of the parameters of all nodes: what happens when a node does not answer."""

from typing import Any

import pytest
import rclpy
import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import Parameter
from rclpy.task import Future

from vessel_hsmc_ros.nodes.recorder import ParameterCollector


def test_an_unanswered_request_is_repeated_and_delays_other_nodes_only_for_a_while(bench: Any) -> None:
    silent = rclpy.create_node("silent", context=bench.context)  # not in an executor: its services do not answer yet
    bench.nodes.append(silent)
    silent.declare_parameter("gain", 2.5)
    clients = [
        bench.probe.create_client(kind, f"/silent/{service}")
        for kind, service in ((ListParameters, "list_parameters"), (GetParameters, "get_parameters"))
    ]
    bench.until(lambda: all(client.service_is_ready() for client in clients))
    collector = ParameterCollector(bench.probe)

    def poll() -> str | None:
        collector.request()
        return collector.new_document()

    assert poll() is None, "the first request is pending"
    document = bench.until(poll)
    assert set(yaml.safe_load(document)) == {"/probe"}

    bench.executor.add_node(silent)
    document = bench.until(poll)
    assert yaml.safe_load(document)["/silent"]["ros__parameters"]["gain"] == 2.5


def test_a_node_that_offers_no_parameters_is_tried_once(bench: Any, monkeypatch: Any) -> None:
    bench.nodes.append(rclpy.create_node("monitor", context=bench.context, start_parameter_services=False))
    bench.until(lambda: "monitor" in bench.probe.get_node_names())
    collector = ParameterCollector(bench.probe)
    created: list[str] = []
    create = bench.probe.create_client

    def noted(kind: Any, name: str) -> Any:
        created.append(name)
        return create(kind, name)

    monkeypatch.setattr(bench.probe, "create_client", noted)
    for _ in range(20):
        collector.request()
    assert [name for name in created if name.startswith("/monitor/")] == ["/monitor/list_parameters", "/monitor/get_parameters"]


@pytest.mark.parametrize("unset", [(), ("first", "last")], ids=["", "declared without a value"])
def test_values_that_are_zero_false_or_empty_are_collected_also_beside_those_that_are_not_set(
    bench: Any, unset: tuple[str, ...]
) -> None:
    values: dict[str, Any] = {"rate": 0.0, "count": 0, "enabled": False, "path": "", "names": ["left", ""], "gains": [0.0]}
    node = rclpy.create_node("plain", context=bench.context)
    bench.nodes.append(node)
    bench.executor.add_node(node)
    for name, value in values.items():
        node.declare_parameter(name, value)
    for name in unset:  # rclpy then answers a request for all of them with nothing
        node.declare_parameter(name, Parameter.Type.DOUBLE)
    collector = ParameterCollector(bench.probe)

    def collected() -> dict[str, Any] | None:
        collector.request()
        return collector.parameters.get("/plain")

    found = bench.until(collected)
    assert {name: value for name, value in found.items() if name in values} == values
    assert not found.keys() & {*unset}


def test_an_answer_that_comes_after_its_request_was_given_up_is_left_alone(bench: Any, monkeypatch: Any) -> None:
    node = rclpy.create_node("slow", context=bench.context)
    bench.nodes.append(node)
    bench.executor.add_node(node)
    node.declare_parameter("gain", 2.5)
    waiting: list[Future] = []
    create = bench.probe.create_client

    def late(kind: Any, name: str) -> Any:
        client = create(kind, name)
        if kind is ListParameters and not waiting and client.service_is_ready():

            def held(_: Any) -> Future:
                waiting.append(Future(executor=bench.executor))
                return waiting[0]

            monkeypatch.setattr(client, "call_async", held)
        return client

    monkeypatch.setattr(bench.probe, "create_client", late)
    collector = ParameterCollector(bench.probe)

    def collected() -> dict[str, Any] | None:
        collector.request()
        return collector.parameters.get("/slow")

    found = bench.until(collected)
    assert found["gain"] == 2.5, "of the repeated request"
    answer = ListParameters.Response()
    answer.result.names = ["gain", "removed"]
    waiting[0].set_result(answer)
    bench.serve()
    assert collector.parameters["/slow"] == found
