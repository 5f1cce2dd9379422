"""Rules among the ROS arguments of a node that name another node: ROS ignores them without a word."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from vessel_hsmc_ros.core.exceptions import ParameterError

PARAMETER, REMAPPING = ("-p", "--param"), ("-r", "--remap")


def check_rules(arguments: Sequence[str], name: str, namespace: str) -> None:
    """Check that each rule with a node's name is one of this node.

    In a rule of a parameter the name stands for the node in the root namespace, and no namespace can be written before it; in a
    rule of a topic or service it stands for the node in every namespace.

    Args:
        arguments: The command line.
        name: The node's name.
        namespace: Its namespace, with a leading slash.

    Raises:
        ParameterError: a rule names another node; the message has the rule that would reach this one.
    """
    full = f"{namespace.rstrip('/')}/{name}"
    for option, rule in _rules(arguments):
        target, _, value = rule.partition(":=")
        node, colon, key = target.partition(":")
        if not colon or key.startswith("__"):
            continue
        if f"/{node}" != full if option in PARAMETER else node != name:
            raise ParameterError(f"{option} {rule} reaches no node: this one is {full}; write {option} {key}:={value}")


def _rules(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The options with their values between `--ros-args` and `--`."""
    within = False
    for argument, following in pairwise(arguments):
        within = argument == "--ros-args" or (within and argument != "--")
        if within and argument in PARAMETER + REMAPPING:
            yield argument, following
