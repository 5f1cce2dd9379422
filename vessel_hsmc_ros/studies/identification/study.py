"""An identification from files to files: motion from bags and CSV files, and the vessel file and the page that are written."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError, IdentificationError, ParameterError
from vessel_hsmc_ros.report.page_kit import writing
from vessel_hsmc_ros.scenario import own_ship
from vessel_hsmc_ros.scenario.run_folder import check_writable
from vessel_hsmc_ros.scenario.vessels import LibraryVessel
from vessel_hsmc_ros.studies.identification import measurements, page, types
from vessel_hsmc_ros.studies.identification.types import Identified, Measurements


def measured(path: Path, columns: Mapping[str, str], topics: Mapping[str, Any]) -> Measurements:
    """The motion in a bag or CSV file. Raises ParameterError if it cannot be read from there."""
    try:
        if path.suffix.lower() == ".csv":
            return measurements.from_csv(path, columns)
        return measurements.from_bag(path, **topics)
    except (BagError, IdentificationError) as error:  # the input is at fault
        raise ParameterError(str(error)) from None


def judged(unused: Sequence[Measurements], found: Identified, start: LibraryVessel | None, window: float) -> list[page.HeldOut]:
    """Predictions of the held-out runs, by the identified ship and by the start vessel."""
    before = schema.flatten(own_ship.ship_of(start.values)) if start else {}
    hull = {name: float(before[name]) for name in found.values if name in before}  # type: ignore[arg-type]
    return [
        page.HeldOut(
            run,
            types.predict(found.values, run, window, found.inputs),
            types.predict(hull, run, window) if start else None,
            page.steady_load(found.values, run, window, found.inputs),
        )
        for run in unused
    ]


class Target(NamedTuple):
    """The vessel that an identification describes."""

    name: str  # of the vessel and of its files
    folder: Path  # of the files
    start: LibraryVessel | None  # gives what is not estimated; None for none
    sizes: Mapping[str, float]  # length and beam, as far as they are given, m

    @property
    def file(self) -> Path:
        """The vessel file."""
        return self.folder / f"{self.name}.yaml"

    def known(self, estimated: Mapping[str, float]) -> dict[str, object]:
        """What is known of the ship beside the estimates, by the names in a vessel file."""
        return (page.known_of(self.start.values, estimated) if self.start else {}) | dict(self.sizes)

    def check(self) -> None:
        """Check before the identification that its files can be written, and replace none but those of an earlier one."""
        page.check_known(self.known({}))
        if self.file.exists() and not page.is_identified(self.file):
            raise ParameterError(f"{self.file} exists and is not an identified vessel: choose another --name or --output")
        self.folder.mkdir(parents=True, exist_ok=True)
        check_writable(self.folder)

    def write(self, runs: Sequence[Measurements], found: Identified, held_out: Sequence[page.HeldOut]) -> list[Path]:
        """Write vessel file and page."""
        errors = {f"{each.run.name}, {key}": text for each in held_out for key, text in page.errors(each.prediction).items()}
        files = {
            self.folder / f"{self.name}.html": page.render(self.name, runs, found, held_out),
            self.file: page.vessel_text(self.name, found, runs, self.known(found.values), errors),
        }
        for path, content in files.items():
            with writing(str(path)):
                path.write_text(content, encoding="utf-8")
        return list(files)
