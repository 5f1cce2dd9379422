"""Calls a verb: up to the function that does its work, or to its exit code."""

import functools
import inspect
import pkgutil
from collections.abc import Callable
from typing import Any

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli, execute

Reach = Callable[..., dict[str, Any]]
"""Call a verb up to a function, with the function's name and the verb's arguments; returns the arguments of the call by name."""


class ReachedError(Exception):
    """Raised in place of the work of a verb."""


def reach_of(monkeypatch: pytest.MonkeyPatch) -> Reach:
    """What replaces functions by `monkeypatch`, and calls verbs."""

    def called(target: str, *arguments: object) -> dict[str, Any]:
        original = pkgutil.resolve_name(target)
        found: dict[str, Any] = {}

        @functools.wraps(original)  # keeps its signature, also for the next call
        def stop(*given: Any, **named: Any) -> None:
            bound = inspect.signature(original).bind(*given, **named)
            bound.apply_defaults()
            found.update(bound.arguments)
            raise ReachedError

        monkeypatch.setattr(target, stop)
        with pytest.raises(ReachedError):
            CliRunner().invoke(cli, [*map(str, arguments)], catch_exceptions=False, standalone_mode=False)
        return found

    return called


def exit_code_of(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run the command in this process, as its entry point does."""
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", *arguments])
    try:
        return execute()
    except SystemExit as end:
        return int(end.code or 0)
