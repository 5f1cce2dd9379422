"""From bags to files: the page, and what else is asked for."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from vessel_hsmc_ros.core.hull import Hull
from vessel_hsmc_ros.report import export, page
from vessel_hsmc_ros.report.from_bag import of_bag
from vessel_hsmc_ros.report.tables import ORIGIN, Record
from vessel_hsmc_ros.scenario.run_folder import RunFolder


@dataclass(frozen=True)
class Wanted:
    """What to make of some bags.

    Attributes:
        page: The page's file; None for report.html beside a single bag, or here for several.
        title: Of the page; None for the runs' names.
        namespace: The vessel's, in bags that hold several.
        figures: png or svg; None for no figures.
        csv, parquet: Whether to write tables.
        hull: How large the ship is drawn.
    """

    page: Path | None = None
    title: str | None = None
    namespace: str | None = None
    figures: str | None = None
    csv: bool = False
    parquet: bool = False
    hull: Hull = field(default_factory=Hull)


@dataclass(frozen=True)
class Made:
    """The runs that were read and the files and folders that were made of them, by what they are."""

    records: list[Record]
    files: dict[str, Path]


def make(bags: Sequence[Path], wanted: Wanted) -> Made:
    """Read bags, write what is wanted of them.

    Raises:
        BagError: a bag cannot be read or has no odometry.
        ReportError: a file cannot be written, or pyarrow is missing.
    """
    records = _named([_read(bag, wanted.namespace) for bag in bags], bags)
    beside = bags[0].absolute().parent if len(bags) == 1 else Path()
    files = {"page": wanted.page or beside / "report.html"}
    folder = files["page"].parent
    page.write(files["page"], records, wanted.title or " · ".join(record.name for record in records), wanted.hull)
    if wanted.figures:
        from vessel_hsmc_ros.report import figures  # matplotlib takes a while to load

        files["figures"] = folder / "figures"
        figures.draw(records, files["figures"], wanted.figures)
    for kind, write in (("csv", export.write_csv), ("parquet", export.write_parquet)):
        if getattr(wanted, kind):
            files[kind] = folder / kind
            for record in records:
                write(record.signals, files[kind] / record.name if len(records) > 1 else files[kind])
    return Made(records, files)


def _read(bag: Path, namespace: str | None) -> Record:
    beside = RunFolder(bag.absolute().parent).read_summary()
    return of_bag(bag, namespace, {name: beside[name] for name in ORIGIN if beside.get(name) not in (None, "")})


def _named(records: list[Record], bags: Sequence[Path]) -> list[Record]:
    """The records by names that tell them apart: scenarios, else folders, else numbers."""
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        names = [bag.absolute().parent.name if bag.name == "bag" else bag.absolute().name for bag in bags]
    count = Counter(names)
    names = [f"{name} {i + 1}" if count[name] > 1 else name for i, name in enumerate(names)]
    return [replace(record, name=name) for record, name in zip(records, names, strict=True)]
