"""The YAML files of scenarios, vessels, suites and campaigns: those of the package by their names, others by their paths."""

import difflib
from dataclasses import dataclass
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.scenario.parameters_file import read_file

SUFFIXES = (".yaml", ".yml")
"""By these a path is told from a name."""


@dataclass(frozen=True)
class NamedFiles:
    """The files of one kind."""

    kind: str  # what one of them is, for messages
    folder: str  # where the package has them, below config

    def names(self) -> list[str]:
        """Those that come with the package."""
        return sorted(path.stem for path in (share_directory() / "config" / self.folder).glob("*.yaml"))

    def path(self, name: str) -> Path:
        """The file of one that comes with the package."""
        return share_directory() / "config" / self.folder / f"{name}.yaml"

    def find(self, name: str | Path, folder: Path = Path()) -> Path:
        """The file of a name or path. Raises ScenarioError if there is none.

        `folder`: where a relative path starts, if a file is there; else in the working directory.
        """
        path = Path(name)
        if path.suffix in SUFFIXES:
            if found := next((each for each in (folder / path, path) if each.is_file()), None):
                return found
            raise ScenarioError(f"{self.kind} file {path} does not exist{self._meant(path)}")
        known = self.names()
        if str(name) not in known:
            must_be = f"it must be one of {', '.join(known)} or the path of a YAML file"
            raise ScenarioError(f"{self.kind} {name} is unknown{self._meant(path)}: {must_be}")
        return self.path(str(name))

    def read(self, path: Path) -> str:
        """The text of a file. Raises ScenarioError if it cannot be read."""
        return read_file(path, f"{self.kind} file")

    def _meant(self, path: Path) -> str:
        """The name or file that a path is nearest to, as a part of an error message; empty if none is near."""
        beside = path.parent.glob("*.y*ml") if path.parent.is_dir() else ()
        shown = {each.stem: f"./{each}" if each.parent == Path() else str(each) for each in beside}
        names = {name: name for name in self.names() if path.parent == Path()} | shown
        near = difflib.get_close_matches(path.stem, names, n=1, cutoff=0.75)
        return f" (did you mean {names[near[0]]}?)" if near else ""


SCENARIOS = NamedFiles("scenario", "")
VESSELS = NamedFiles("vessel", "vessels")
SUITES = NamedFiles("suite", "suites")
CAMPAIGNS = NamedFiles("campaign", "campaigns")
