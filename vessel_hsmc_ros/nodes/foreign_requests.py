"""Requests to the services that rclpy itself offers, such as those of parameters and of the lifecycle."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.service import Service


def survive_requests(node: Node, services: Iterable[Service]) -> None:
    """Answer a request with which the code of a service fails by its empty response and a line on the log.

    rclpy raises for a transition that the present state does not have, and for a parameter of an unknown type: whoever
    requested that would end the node.

    Args:
        node: Owner of the services.
        services: Those of rclpy.
    """
    for service in services:
        service.callback = partial(_answer, node, service.srv_name, service.callback)


def _answer(node: Node, name: str, serve: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
    try:
        return serve(request, response)
    except Exception as error:
        text = str(error).splitlines()
        node.get_logger().error(f"a request to {name} is refused: {type(error).__name__}: {text[0] if text else ''}")
        return response
