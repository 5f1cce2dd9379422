"""The connection of a verb with running nodes."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from vessel_hsmc_ros.cli.options import checked_namespace
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.nodes.ros_environment import check_ros

if TYPE_CHECKING:
    from collections.abc import Iterator

    from vessel_hsmc_ros.nodes.remote import Remote


@contextmanager
def running_vessel(namespace: str) -> Iterator[Remote]:
    """A connection with the nodes in a namespace.

    Raises:
        ParameterError: the namespace is not one of ROS.
        InstallationError: two installations of ROS would mix.
        RunError: ROS is not installed.
    """
    checked = checked_namespace(namespace)
    check_ros()
    try:
        from vessel_hsmc_ros.nodes.remote import Remote
    except ModuleNotFoundError as error:
        raise RunError(missing_module(error)) from None
    with Remote(checked) as remote:
        yield remote
