"""The journal of a tuning: the file in which Optuna records every trial, exclusive to one process and whole after any crash."""

import fcntl
import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

from vessel_hsmc_ros.core.exceptions import RunError, ScenarioError

NAME = "tuning"

DEFINITION = "definition"
"""The attribute of the study that describes the tuning."""


@contextmanager
def open_study(folder: Path, objectives: int, definition: Mapping[str, Any]) -> Iterator[optuna.Study]:
    """Open the study in a folder, or begin one; no other process can open it meanwhile.

    Args:
        folder: An existing folder; the study is in its file journal.log.
        objectives: The number of objectives, all minimised.
        definition: What defines the tuning, in JSON types.

    Raises:
        RunError: another process tunes in this folder, or the journal cannot be written.
        ScenarioError: the journal is not one, or belongs to another tuning.
    """
    path = folder / "journal.log"
    try:
        with (folder / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise RunError(f"{folder} is in use: another process is tuning there") from None
            _repair(path)
            yield _study(path, objectives, definition)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror}") from None


def _repair(path: Path) -> None:
    """Remove what a killed process may have left: half a line at the end, and the lock file of Optuna."""
    path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
    if not path.exists():
        return
    content = path.read_bytes()
    if not content.startswith(b"{") and content:
        raise ScenarioError(f"{path} is not the journal of a tuning: choose another folder by --output")
    if len(content) > (end := content.rfind(b"\n") + 1):
        os.truncate(path, end)


def _study(path: Path, objectives: int, definition: Mapping[str, Any]) -> optuna.Study:
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.filterwarnings("ignore", category=optuna.exceptions.ExperimentalWarning)
    try:
        storage = JournalStorage(JournalFileBackend(str(path)))
        study = optuna.create_study(study_name=NAME, storage=storage, directions=["minimize"] * objectives, load_if_exists=True)
        recorded = study.user_attrs.get(DEFINITION)
    except (ValueError, KeyError, TypeError, AttributeError, AssertionError) as error:
        line = " ".join(str(error).split()) or type(error).__name__
        raise ScenarioError(f"{path} is not the journal of a tuning: {line}; choose another folder by --output") from None
    if recorded is None and not study.trials:
        study.set_user_attr(DEFINITION, dict(definition))
    elif different := _difference(recorded or {}, definition):
        raise ScenarioError(f"{path} belongs to another tuning: {different}; choose another folder by --output")
    return study


def _difference(recorded: Mapping[str, Any], definition: Mapping[str, Any]) -> str:
    """The first entry in which two definitions differ, in words; empty if they are equal."""
    for name, value in definition.items():
        if recorded.get(name) != value:
            there, here = (_short(each) for each in (recorded.get(name), value))
            return f"{name} {there} there and {here} here" if len(there + here) < 120 else f"other {name}"
    return ""


def _short(value: object) -> str:
    return "is missing" if value is None else f"= {value}"
