"""The page of one or several runs: a single HTML file without external resources."""

import csv
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros.bags.files import bag_path
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.hull import DrawnHull, Hull, described, vessel_name
from vessel_hsmc_ros.core.metrics import Run, Table, control_table, motion_table
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.report import figures, page_kit
from vessel_hsmc_ros.report.diagrams import LIMIT_DASHES, SERIES, look, run_colour
from vessel_hsmc_ros.report.from_bag import of_fleet, of_vessel
from vessel_hsmc_ros.report.page_kit import Payload, writing
from vessel_hsmc_ros.report.panels import (
    DESIRED,
    MAIN,
    REFERENCE,
    Overlay,
    Plan,
    Stops,
    Track,
    fences,
    overlays,
    plans,
    stops,
    tracks,
)
from vessel_hsmc_ros.report.record import ORIGIN, Record, leg_rows, over_shared_interval
from vessel_hsmc_ros.report.tables import metrics_table, parameter_tables, provenance_table, value_text
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.run_folder import RunFolder, check_writable, file_name

SCRIPTS = (
    "units.js",
    "data.js",
    "clock.js",
    "export.js",
    "legend.js",
    "marks.js",
    "chart.js",
    "track.js",
    "map.js",
    "theme.js",
    "diagram.js",
    "figures.js",
    "main.js",
)
LINE_VALUES, PAGE_VALUES = 50_000, 3_000_000
"""Largest number of values of one line, and of all lines of a page; 4 bytes each before compression."""

NARROW_RUNS = 3
"""Largest number of runs whose metrics are shown beside the map; the table of more runs has the width of the page."""


def write(path: Path, records: Sequence[Record], title: str, hull: Hull | None = None, notes: Sequence[str] = ()) -> None:
    """Write the page of some runs.

    `records`: at least one run; the others are compared with the first. `hull`: dimensions of the ship that is drawn; None for
    those of the first run's scenario. `notes`: paragraphs below the headline. Raises ReportError if the file cannot be written.
    """
    page = render(records, title, hull or hull_of(records), notes)
    with page_kit.writing(f"report {path}"):
        path.write_text(page, encoding="utf-8")


def hull_of(records: Sequence[Record]) -> Hull:
    """The hull of the first run's ship; that of the paper where its scenario is not known."""
    scenario = records[0].scenario
    return scenario.vessel_sim.vessel if scenario else Hull()


def render(records: Sequence[Record], title: str, hull: Hull, notes: Sequence[str] = ()) -> str:
    """Render the HTML text of a page; for the arguments see `write`."""
    overlaid = overlays(records)
    content, numbers = _content(records, overlaid, hull)
    return page_kit.render(
        "report/page.html",
        title,
        [_subtitle(records)],
        scripts=SCRIPTS,
        content=content,
        notes=notes,
        names=[record.name for record in records],
        colours=len(SERIES),
        wide=len(records) > NARROW_RUNS,
        tracks=content["tracks"],
        planned=bool(content["plans"]),
        fenced=bool(content["fences"]),
        legs=_legs(records),
        hull=hull,
        groups=_groups(overlaid),
        verdicts=_verdicts(records),
        marks=content["marks"],
        jitter=content["figures"][0],
        metrics=metrics_table(records),
        compared=not of_one_fleet(records),
        parameters=parameter_tables(records),
        provenance=provenance_table(records),
        resolution=_resolution(content["panels"], records),
        numbers=numbers,
    )


def of_one_fleet(records: Sequence[Record]) -> bool:
    """Whether the records are of the vessels of one bag, of which none is the standard of the others."""
    bags = {record.provenance.get("bag") for record in records}
    names = {record.provenance.get("namespace") for record in records}
    return len(bags) == 1 and len(names) == len(records) > 1


def _content(records: Sequence[Record], overlaid: Sequence[Overlay], hull: Hull) -> tuple[dict[str, Any], str]:
    """Diagrams and tracks for the scripts of the page, and the compressed numbers to which they refer."""
    alone = len(records) == 1
    lines = sum(len(overlay.lines) for overlay in overlaid)
    # Many runs share the budget of the page, but each line keeps enough values for its shape.
    payload = Payload(max(2000, min(LINE_VALUES, PAGE_VALUES // max(1, lines))))
    content = {
        "begin": min(float(record.run.time[0]) for record in records),
        "end": max(float(record.run.time[-1]) for record in records),
        "hull": {"length": hull.length, "beam": hull.beam},
        "panels": [_panel(payload, overlay, alone) for overlay in overlaid],
        "tracks": [_track(payload, track, alone) for track in tracks(records)],
        "plans": [_plan(payload, plan) for plan in plans(records)],
        "fences": [[[corner.real, corner.imag] for corner in ring] for ring in fences(records)],
        "stops": [_stop(payload, each) for each in stops(records)],
        "marks": _marks(records),
        "figures": [figures.jitter(records)],
    }
    return content, payload.text()


def _panel(payload: Payload, overlay: Overlay, alone: bool) -> dict[str, Any]:
    """A panel as chart.js expects it, every line with its label and colour."""
    panel = overlay.panel
    lines = [
        {**payload.line(owned.line), "label": owned.label, **look(owned.run, owned.line.role, alone)} for owned in overlay.lines
    ]
    dashes = cycle(LIMIT_DASHES)
    limits = [{**limit._asdict(), "dash": dash} for limit, dash in zip(panel.limits, dashes, strict=False)]
    return {"title": panel.title, "unit": panel.unit, "limits": limits, "step": panel.step, "help": panel.help, "lines": lines}


def _track(payload: Payload, track: Track, alone: bool) -> dict[str, Any]:
    """A ship or a reference as map.js expects it."""
    shown = {"role": track.role, "run": track.run, "label": track.label}
    drawn = look(track.run, DESIRED if track.role == REFERENCE else MAIN, alone)
    return {**payload.poses(track.time, track.poses), **shown, "colour": drawn["colour"]}


def _plan(payload: Payload, plan: Plan) -> dict[str, Any]:
    """Planned legs as the map draws them."""
    outlines = [payload.points(points) for points in plan.outlines]
    return {"outlines": outlines, "waypoints": [[point.real, point.imag] for point in plan.waypoints]}


def _stop(payload: Payload, found: Stops) -> dict[str, Any]:
    """A stopping set over time as the map draws it."""
    arrays = {"time": payload.add(found.time, "f8"), "reach": payload.add(found.reach), "radius": payload.add(found.radius)}
    return {"run": found.run, **arrays}


def _legs(records: Sequence[Record]) -> list[dict[str, Any]]:
    """The errors of each leg of each run that has planned legs, to a micrometre."""
    tables = []
    for record in records:
        rows = [
            (str(leg), *(quantity(round(value, 6), "m") for value in values), quantity(round(missed, 3), "%"))
            for leg, *values, missed in leg_rows(record)
        ]
        if rows:
            tables.append({"name": record.name, "rows": rows})
    return tables


def _groups(overlaid: Sequence[Overlay]) -> list[dict[str, Any]]:
    groups: dict[str, list[dict[str, Any]]] = {}
    for i, overlay in enumerate(overlaid):
        panel = overlay.panel
        shown = {"index": i, "title": panel.title, "unit": panel.unit, "help": panel.help}
        groups.setdefault(panel.group, []).append(shown)
    return [{"name": name, "panels": panels} for name, panels in groups.items()]


def _marks(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Events of all runs in the order of their times, each with its run's index and colour and the text that labels it."""
    found = []
    for run, record in enumerate(records):
        alone = len(records) == 1
        colour = "--ink-soft" if alone else run_colour(run)
        for mark in record.marks:
            what = f"{mark.kind}: {mark.text}" if mark.text else mark.kind
            label = what if alone else f"{record.name}, {what}"
            found.append({"t": mark.time, "kind": mark.kind, "text": mark.text, "label": label, "run": run, "colour": colour})
    return sorted(found, key=lambda mark: mark["t"])


def _verdicts(records: Sequence[Record]) -> list[dict[str, str]]:
    """The verdicts of the runs that have one, with the runs' names and colours."""
    return [
        {"name": record.name, "text": record.verdict, "colour": run_colour(run)}
        for run, record in enumerate(records)
        if record.verdict
    ]


def _subtitle(records: Sequence[Record]) -> str:
    """Durations, laws and ships of the runs."""
    durations = dict.fromkeys(quantity(record.duration, "s") for record in records)
    parts = [" and ".join(durations)]
    laws = dict.fromkeys(record.scenario.controller.law for record in records if record.scenario)
    if laws:
        parts.append("control law " + ", ".join(laws))
    parts += dict.fromkeys(described(record.scenario.vessel_sim.vessel) for record in records if record.scenario)
    if len(records) > 1:
        parts.insert(0, f"{len(records)} runs")
    return " · ".join(parts)


def _resolution(panels: Sequence[dict[str, Any]], records: Sequence[Record]) -> str:
    """A sentence on the resolution of the diagrams."""
    size = max((line["bucket"] for panel in panels for line in panel["lines"]), default=1)
    if size == 1:
        return "The diagrams contain every sample."
    period = float(np.median(np.diff(records[0].run.time[:1000])))
    return (
        f"The diagrams contain the minimum and the maximum of every {size} samples ({size * period:.3g} s),"
        " so no peak is lost; the bag contains all samples."
    )


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
    return write_files(read(bags, options.namespace, options.odometry, options.wrench), replace(options, page=chosen))


def write_files(records: Sequence[Record], options: Options) -> WrittenFiles:
    """Write the page of some records, and the requested figures and tables."""
    files = {"page": options.page or Path(PAGE)}
    # WrittenFiles beside a page that is not report.html carry its name: pages of other bags may lie in the same folder.
    prefix = "" if files["page"].name == PAGE else f"{files['page'].stem}_"
    ships = dict.fromkeys(
        vessel_name(record.scenario.vessel_sim.vessel) for record in records if record.scenario
    )  # "": the paper's
    title = options.title or " · ".join([*(record.name for record in records), *filter(None, ships)])
    write(files["page"], records, title, options.hull.of(hull_of(records)), options.notes)
    if options.figures:
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
