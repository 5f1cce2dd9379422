"""The last check of a command before it leaves a node: finite numbers, whatever was computed after its input was checked."""

from collections.abc import Callable, Sequence

LARGEST = 3.4e38  # the largest magnitude that counts as finite: autopilots take commands in single precision


def is_finite(command: Sequence[float]) -> bool:
    """Whether all numbers of a command are finite, in single precision too."""
    return all(abs(value) <= LARGEST for value in command)  # False for NaN


def finite(command: tuple[float, ...], report: Callable[[str], None]) -> tuple[float, ...]:
    """A command of finite numbers as it is; any other is reported, and zero takes its place."""
    if is_finite(command):
        return command
    report(f"the output must be finite numbers (got {', '.join(map(str, command))}): zero is sent")
    return (0.0,) * len(command)
