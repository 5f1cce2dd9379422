"""Makes the files of a report from bags: the page with labels of its runs, and on request figures and tables (CSV or Parquet)."""

import csv
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.bags.files import bag_path
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.hull import DrawnHull, vessel_name
from vessel_hsmc_ros.core.metrics import Run, Table, control_table, motion_table
from vessel_hsmc_ros.report import page
from vessel_hsmc_ros.report.from_bag import of_fleet, of_vessel
from vessel_hsmc_ros.report.page_kit import writing
from vessel_hsmc_ros.report.record import ORIGIN, Record, over_shared_interval
from vessel_hsmc_ros.report.tables import value_text
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.run_folder import RunFolder, check_writable, file_name

MAX_LABEL_TEXTS = 2  # differing parameters that a label names; the table of parameters has all of them


def distinguished(records: Sequence[Record]) -> list[Record]:
    """Label runs by what differs between them: scenario, else law, else both, else parameters, else a number.

    Returns the records with unique names; a single one keeps its name.
    """
    names = [record.name for record in records]
    if len(records) < 2:
        return list(records)
    candidates = [names]
    if all(record.scenario for record in records):
        laws = [record.scenario.controller.law for record in records if record.scenario]
        candidates += [laws, [f"{name}, {law}" for name, law in zip(names, laws, strict=True)], _by_parameters(records)]
    # The first kind of label that is unique for every run.
    chosen = next((candidate for candidate in candidates if len(set(candidate)) == len(records)), None)
    return [replace(record, name=name) for record, name in zip(records, chosen or _numbered(candidates[-1], names), strict=True)]


def _by_parameters(records: Sequence[Record]) -> list[str]:
    """The parameters that differ, such as `sway_weight = 0.002`."""
    flat = [_parameters(record) for record in records]
    differing = [name for name in flat[0] if any(values[name] != flat[0][name] for values in flat)]
    labels = []
    for values in flat:
        texts = dict.fromkeys(f"{name.rsplit('.', 1)[-1]} = {value_text(values[name])}" for name in differing)
        more = ", …" if len(texts) > MAX_LABEL_TEXTS else ""
        labels.append(", ".join(list(texts)[:MAX_LABEL_TEXTS]) + more)
    return labels


def _parameters(record: Record) -> dict[str, Any]:
    """The parameters that affect a run: without those of the recorder and the folder of the black box."""
    nodes = [node for node in NODES if node != "recorder"]
    flat = {f"{n}.{name}": value for n in nodes for name, value in schema.flatten(getattr(record.scenario, n)).items()}
    return {name: value for name, value in flat.items() if name != "controller.black_box.directory"}


def _numbered(labels: Sequence[str], names: Sequence[str]) -> list[str]:
    """Labels, or names where a label is empty, with numbers where they are the same."""
    labels = [label or name for label, name in zip(labels, names, strict=True)]
    count = Counter(labels)
    return [f"{label} {i + 1}" if count[label] > 1 else label for i, label in enumerate(labels)]


PAGE = "report.html"


@dataclass(frozen=True)
class Options:
    """The requested files and their properties."""

    page: Path | None = None  # the page's file; None for the default of `page_of`
    title: str | None = None  # headline of the page; None for the names of the runs
    namespace: str | None = None  # ROS namespace of the vessel, in bags that hold several
    # odometry, wrench: topics of them, where they are not found by name or type
    odometry: str = ""
    wrench: str = ""
    figures: str | None = None  # png or svg; None for no figures
    # csv, parquet: whether to write tables
    csv: bool = False
    parquet: bool = False
    # dimensions of the ship that is drawn, by default those of the first run's ship
    hull: DrawnHull = field(default_factory=DrawnHull)
    notes: tuple[str, ...] = ()  # paragraphs below the headline


@dataclass(frozen=True)
class WrittenFiles:
    """The written files and folders by kind (page, figures, csv, parquet), and the records of the runs."""

    records: list[Record]
    files: dict[str, Path]


def make(bags: Sequence[Path], options: Options) -> WrittenFiles:
    """Read bags, or the bags of run folders, and write their page and the requested figures and tables."""
    bags = [bag_path(bag) for bag in bags]
    chosen = options.page or page_of(bags)
    check_writable(chosen.parent)
    return write(read(bags, options.namespace, options.odometry, options.wrench), replace(options, page=chosen))


def _ships(records: Sequence[Record]) -> list[str]:
    """The names of the ships that are not the paper's."""
    names = (vessel_name(record.scenario.vessel_sim.vessel) for record in records if record.scenario)
    return [name for name in dict.fromkeys(names) if name]


def write(records: Sequence[Record], options: Options) -> WrittenFiles:
    """Write the page of some records, and the requested figures and tables."""
    files = {"page": options.page or Path(PAGE)}
    # WrittenFiles beside a page that is not report.html carry its name: pages of other bags may lie in the same folder.
    prefix = "" if files["page"].name == PAGE else f"{files['page'].stem}_"
    title = options.title or " · ".join([*(record.name for record in records), *_ships(records)])
    page.write(files["page"], records, title, options.hull.of(page.hull_of(records)), options.notes)
    if options.figures:
        from vessel_hsmc_ros.report import figures  # matplotlib takes a while to load

        files["figures"] = files["page"].parent / f"{prefix}figures"
        figures.draw(records, files["figures"], options.figures)
    for kind, export_run in (("csv", write_csv), ("parquet", write_parquet)):
        if getattr(options, kind):
            files[kind] = files["page"].parent / f"{prefix}{kind}"
            for record in records:
                export_run(record.run, files[kind] / file_name(record.name) if len(records) > 1 else files[kind])
    return WrittenFiles(list(records), files)


def read(bags: Sequence[Path], namespace: str | None = None, odometry: str = "", wrench: str = "") -> list[Record]:
    """Read the records of bags, labelled by what distinguishes them, with metrics over the interval that all of them cover."""
    records: list[Record] = []
    for path in bags:
        bag = open_bag(path, odometry, wrench)
        summary = RunFolder(bag.path.absolute().parent).read_summary()
        origin = {name: summary[name] for name in (*ORIGIN, "failure") if summary.get(name) not in (None, "")}
        several = len(bag.namespaces) > 1 and namespace is None and not odometry
        records += of_fleet(bag, origin) if several else [of_vessel(bag, bag.namespace(namespace), origin)]
    return over_shared_interval(distinguished(records))


def page_of(bags: Sequence[Path]) -> Path:
    """The default path of the page of some bags.

    A run folder has one bag, named `bag`, and its page is report.html beside it. Any other bag may have neighbours, so its
    page carries its name. The page of several bags is report.html in the current folder.
    """
    if len(bags) > 1:
        return Path(PAGE)
    bag = bags[0].absolute()
    return bag.parent / (PAGE if bag.name == "bag" else f"{bag.stem if bag.is_file() else bag.name}_{PAGE}")


ROWS = 10_000  # rows that are converted to Python numbers at a time: those of a long run would not fit into memory


def tables(run: Run) -> dict[str, Table]:
    """The tables of a run: `motion` with a row for each state, `control` with a row for each update of the law.

    Columns are in SI units and radians. Quantities that were not recorded have no column.
    """
    found = {"motion": motion_table(run), "control": control_table(run)}
    return {name: table for name, table in found.items() if len(table) > 1}


def write_csv(run: Run, directory: Path) -> list[Path]:
    """Write `motion.csv` and `control.csv`; every number reads back bit-identical."""

    def write(table: Table, path: Path) -> None:
        # Flags as 0 and 1: True and False are not numbers to most programs that read CSV.
        columns = [values.astype(int) if values.dtype == bool else values for values in table.values()]
        with path.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(table)
            for first in range(0, len(columns[0]), ROWS):
                writer.writerows(zip(*(column[first : first + ROWS].tolist() for column in columns), strict=True))

    return _write(run, directory, "csv", write)


def write_parquet(run: Run, directory: Path) -> list[Path]:
    """Write `motion.parquet` and `control.parquet`."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise ReportError("Parquet needs pyarrow, which is not installed: pip install pyarrow, or use --csv") from None
    return _write(run, directory, "parquet", lambda table, path: parquet.write_table(pyarrow.table(table), path))


def _write(run: Run, directory: Path, kind: str, write: Callable[[Table, Path], None]) -> list[Path]:
    paths = []
    with writing(f"tables in {directory}"):
        directory.mkdir(parents=True, exist_ok=True)
        for name, table in tables(run).items():
            paths.append(directory / f"{name}.{kind}")
            write(table, paths[-1])
    return paths
