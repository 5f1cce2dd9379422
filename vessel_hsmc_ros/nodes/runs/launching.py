"""What the launch files share: checked arguments, and an end by an error that leaves no process behind.

An exception while launch visits a description loses sight of all processes of that description, also of those of whoever includes
it: launch ends, they go on. Here an error becomes an event instead, which launch handles after the visit, and then raises.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any

from launch.actions import EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.substitutions import LaunchConfiguration
from launch_ros.utilities import make_namespace_absolute, prefix_namespace
from rclpy.exceptions import NameValidationException
from rclpy.validate_namespace import validate_namespace

from launch import Event, EventHandler, LaunchContext
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError, VesselHsmcError
from vessel_hsmc_ros.core.install_paths import missing_module

FAILED = "vessel_hsmc_ros_failed"  # where a launch context keeps the reason of its end


class Failure(Event):  # type: ignore[misc]
    """Something has failed: the launch ends."""

    name = "vessel_hsmc_ros.Failure"


def failure(reason: str) -> list[Any]:
    """The actions that end the launch: one ERROR line with the reason, all its nodes are shut down, exit code 1.

    Only an exception gives `ros2 launch` a nonzero exit code. Failures after the first are taken as its consequences.
    """
    event = Failure()

    def end(context: LaunchContext) -> None:
        if FAILED not in context.get_locals_as_dict():
            context.extend_globals({FAILED: reason})
            raise RunError(reason)

    return [
        RegisterEventHandler(EventHandler(matcher=lambda other: other is event, entities=[OpaqueFunction(function=end)])),
        EmitEvent(event=event),
    ]


def never_raising(actions: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    """Let a function that returns actions return those of `failure` where it raises."""

    @wraps(actions)
    def guarded(*arguments: Any) -> list[Any]:
        try:
            return actions(*arguments)
        except ModuleNotFoundError as error:
            return failure(missing_module(error))
        except VesselHsmcError as error:
            return failure(str(error))
        except Exception as error:  # whatever it is, the processes that have been started must end
            return failure(f"unexpected {type(error).__name__}: {error}")

    return guarded


def argument(context: LaunchContext, name: str) -> str:
    """The text of a launch argument."""
    return str(LaunchConfiguration(name).perform(context))


def flag(context: LaunchContext, name: str) -> bool:
    """A launch argument that is true or false, in capital letters or not. Raises ParameterError if it is neither."""
    text = argument(context, name)
    if text.lower() not in ("true", "false"):
        raise ParameterError(f"{name} must be true or false (got {text!r})")
    return text.lower() == "true"


def namespace_of(context: LaunchContext) -> str:
    """The absolute namespace of the nodes: the argument `namespace` below what `PushRosNamespace` has pushed.

    Raises ParameterError if it is not a namespace.
    """
    given = argument(context, "namespace")
    namespace = str(make_namespace_absolute(prefix_namespace(context.launch_configurations.get("ros_namespace"), given)))
    try:
        validate_namespace(namespace)
    except NameValidationException as error:
        raise ParameterError(f"namespace must be names of letters, digits and _, separated by / (got {given!r})") from error
    return namespace
