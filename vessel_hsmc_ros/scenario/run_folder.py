"""The folder of a run: parameters, bag, logs, figures, report, and its summary run.json."""

import datetime
import json
import platform
import re
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.scenario.parameters_file import read_text


@dataclass(frozen=True)
class RunFolder:
    """Paths inside the folder of one run."""

    path: Path

    @property
    def bag(self) -> Path:
        """Folder of the recorded bag."""
        return self.path / "bag"

    @property
    def parameters(self) -> Path:
        """Every parameter of every node, as a ROS parameters file."""
        return self.path / "params.yaml"

    @property
    def logs(self) -> Path:
        """Folder of the nodes' output, one log file each."""
        return self.path / "logs"

    @property
    def figures(self) -> Path:
        """Folder of the figures."""
        return self.path / "figures"

    @property
    def report(self) -> Path:
        """The report page."""
        return self.path / "report.html"

    def write_parameters(self, text: str) -> None:
        """Write the text of a ROS parameters file as that of the run. Raises RunError if it cannot be written."""
        _write(self.parameters, text)

    @property
    def summary(self) -> Path:
        """The summary: provenance, exit code, metrics."""
        return self.path / "run.json"

    def read_summary(self) -> dict[str, Any]:
        """Read run.json; an empty mapping if it is missing or unreadable."""
        try:
            content = json.loads(read_text(self.summary))
        except (OSError, ValueError, RecursionError):
            return {}
        return content if isinstance(content, dict) else {}

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Write run.json, with null for a number that is not finite; an older one stays if that fails."""
        finite = json.loads(json.dumps(summary), parse_constant=lambda _: None)  # JSON has no infinity
        _write(self.summary, json.dumps(finite, indent=2) + "\n")


def _write(path: Path, text: str) -> None:
    """Write a file that exists either completely or not at all."""
    new = path.with_suffix(".new")
    try:
        new.write_text(text, encoding="utf-8")
        new.replace(path)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise RunError(f"{path} cannot be written: {error.strerror}") from None


def check_writable(folder: Path) -> None:
    """Check that files can be written into a folder, which need not exist, before something is computed for it."""
    existing = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    try:  # the permissions are not sufficient: the file system may be read-only, and root may write anywhere else
        with tempfile.NamedTemporaryFile(dir=existing) as file:
            file.write(b"\n")
            file.flush()
    except OSError as error:
        raise RunError(f"files cannot be made in {folder}: {error.strerror}") from None


def file_name(name: str) -> str:
    """A name as that of a file or folder: letters of every script are kept, other characters become underscores."""
    return re.sub(r"[^\w.=-]+", "_", name)


def make_run_folder(parent: Path, name: str) -> RunFolder:
    """Create the folder `<parent>/<time>_<name>`, in UTC, numbered if several runs start within a second."""
    now = datetime.datetime.now(tz=datetime.timezone.utc)
    stem = f"{now:%Y%m%dT%H%M%S}_{file_name(name)}"
    for attempt in range(1000):
        path = parent / (stem if attempt == 0 else f"{stem}_{attempt + 1}")
        try:
            path.mkdir(parents=True)
        # mkdir is atomic, so runs that start at the same time get different folders.
        except FileExistsError:
            if not path.exists():
                raise RunError(f"run folder {path} cannot be made: {parent} is not a folder") from None
        except OSError as error:
            raise RunError(f"run folder {path} cannot be made: {error.strerror}") from None
        else:
            return RunFolder(path)
    raise RunError(f"run folder {parent / stem} cannot be made: a thousand of that name exist")


def folder_for(output: Path | None, name: str) -> Path:
    """A folder for the files of a study: the given one, which may exist, or a new one in `runs`."""
    if output is None:
        check_writable(Path("runs"))
        return make_run_folder(Path("runs"), name).path
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"folder {output} cannot be made: {error.strerror}") from None
    check_writable(output)
    return output


def provenance() -> dict[str, Any]:
    """Version of the code, and the machine it runs on."""
    return {
        "version": __version__,
        "git_commit": _git_commit(),
        "host": platform.node(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def _git_commit() -> str | None:
    """The commit of the checkout, with a plus if there are uncommitted changes; None outside a checkout."""
    here = Path(__file__).resolve().parent
    try:
        described = subprocess.run(
            ["git", "describe", "--always", "--abbrev=40", "--dirty=+", "--exclude=*"],  # noqa: S607
            cwd=here,
            capture_output=True,
            text=True,
            timeout=5.0,
            check=True,
        )
    # No git, or an installed package: provenance is information and must not fail a run.
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip()


def write_summary(
    folder: RunFolder, origin: Mapping[str, Any], exit_code: int, failure: str, measured: Mapping[str, Any]
) -> None:
    """Write run.json.

    `origin`: provenance of the run, with the time of its start. `failure`: what failed, in one line; empty if nothing did.
    """
    duration = (
        datetime.datetime.now(tz=datetime.timezone.utc) - datetime.datetime.fromisoformat(origin["started"])
    ).total_seconds()
    folder.write_summary({**origin, "duration": duration, "exit_code": exit_code, "failure": failure, **measured})
