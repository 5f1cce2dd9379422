"""`vessel-hsmc identify`: the hull data of a ship from its recorded motion."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_status, print_table, print_warning, progress_bar
from vessel_hsmc_ros.cli.options import topic_options
from vessel_hsmc_ros.core.exceptions import BagError, IdentificationError, ParameterError
from vessel_hsmc_ros.scenario.run_folder import check_writable

if TYPE_CHECKING:
    from vessel_hsmc_ros.scenario.vessels import LibraryVessel
    from vessel_hsmc_ros.studies.identification.page import HeldOut
    from vessel_hsmc_ros.studies.identification.types import Identified, Measurements


@click.command()
@click.argument("data", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="BAG|CSV...")
@click.option(
    "--model",
    "names",
    default="coupled",
    show_default=True,
    metavar="MODEL|NAMES",
    help="What is estimated: paper (inertia and damping of each axis), coupled (sway and yaw coupled as well), linear (linear"
    " damping only), or names of hull parameters, separated by commas.",
)
@click.option(
    "--vessel",
    metavar="NAME|FILE",
    help="A vessel of the library or a vessel file; it gives the dimensions, the limits and all that is not estimated.",
)
@click.option("--length", type=float, metavar="m", help="Length of the ship, without --vessel.")
@click.option("--beam", type=float, metavar="m", help="Beam of the ship, without --vessel.")
@click.option(
    "--held-out",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="BAG|CSV",
    help="A run that is kept back to judge the prediction; may be given several times.",
)
@click.option("--namespace", help="ROS namespace of the vessel, if a bag holds several.")
@topic_options
@click.option(
    "--column", "columns", multiple=True, metavar="NAME=COLUMN", help="Column of the CSV files, such as surge_force=Fx."
)
@click.option("--window", type=float, default=20.0, show_default=True, metavar="s", help="Length of a simulated window.")
@click.option("--name", default="identified", show_default=True, help="Name of the vessel and of its file.")
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(),
    help="Folder of the files, which replace those of an earlier identification [default: this one].",
)
def identify(
    data: Sequence[Path], names: str, vessel: str | None, held_out: Sequence[Path], columns: Sequence[str], **options: Any
) -> None:
    """Identify the hull data of a ship from bags or CSV files of its motion.

    A bag holds odometry and the applied or commanded wrench; a CSV file the columns time, x, y, heading (or heading_deg),
    surge_force, yaw_moment, and u, v, r where measured. Writes NAME.yaml, a vessel that scenarios and `vessel-hsmc init`
    take, and NAME.html, which shows measured against simulated motion and how well each parameter is known.
    """
    from vessel_hsmc_ros.scenario.own_ship import ship_of
    from vessel_hsmc_ros.scenario.vessels import read_vessel
    from vessel_hsmc_ros.studies.identification.estimate import identify as estimate
    from vessel_hsmc_ros.studies.identification.types import MODELS, model

    chosen = model(names if names in MODELS or "_" not in names else tuple(part.strip() for part in names.split(",")))
    start = None if vessel is None else read_vessel(vessel)
    named = _columns(columns)
    if again := {path.resolve() for path in data} & {path.resolve() for path in held_out}:
        raise ParameterError(f"--held-out must be a run that the estimation does not use (got {min(again)})")
    topics = {key: options[key] for key in ("namespace", "odometry", "wrench")}
    runs = [_measurements(path, named, topics) for path in data]
    unused = [_measurements(path, named, topics) for path in held_out]
    _check_output(options, start)
    known = ship_of(start.values) if start else None
    with progress_bar(f"identifying {options['name']}", 100.0, "%") as update:
        found = estimate(runs, chosen, known, options["window"], lambda what, done: update(100.0 * done, note=what))
    judged = _judged(unused, found, start, options["window"])
    _write(options, runs, found, judged, start)
    _print(runs, found, judged)
    vessel = options["output"] / f"{options['name']}.yaml"
    print_line(f"next: vessel-hsmc init NAME --vessel {shlex.quote(str(vessel))}")


def _check_output(options: dict[str, Any], start: "LibraryVessel | None") -> None:
    """Check before the identification that its files can be written, and that they replace none but those of an earlier one."""
    from vessel_hsmc_ros.studies.identification.page import check_known, is_identified

    check_known(_known(options, start, {}))
    vessel = options["output"] / f"{options['name']}.yaml"
    if vessel.exists() and not is_identified(vessel):
        raise ParameterError(f"{vessel} exists and is not an identified vessel: choose another --name or --output")
    options["output"].mkdir(parents=True, exist_ok=True)
    check_writable(options["output"])


def _known(options: dict[str, Any], start: "LibraryVessel | None", estimated: Mapping[str, float]) -> dict[str, object]:
    """What is known of the ship beside the estimates, by the names in a vessel file."""
    from vessel_hsmc_ros.studies.identification.page import known_of

    known = known_of(start.values, estimated) if start else {}
    return known | {key: options[key] for key in ("length", "beam") if options[key] is not None}


def _columns(given: Sequence[str]) -> dict[str, str]:
    """Columns of the CSV files by what they hold."""
    for text in given:
        if "=" not in text:
            raise ParameterError(f"--column must be NAME=COLUMN (got {text})")
    return {name: column for name, _, column in (text.partition("=") for text in given)}


def _measurements(path: Path, columns: dict[str, str], topics: dict[str, Any]) -> "Measurements":
    """The motion in a bag or CSV file."""
    from vessel_hsmc_ros.studies.identification.measurements import from_bag, from_csv

    try:
        return from_csv(path, columns) if path.suffix.lower() == ".csv" else from_bag(path, **topics)
    except (BagError, IdentificationError) as error:  # the input is at fault: exit code 2
        raise ParameterError(str(error)) from None


def _judged(
    unused: "Sequence[Measurements]", found: "Identified", start: "LibraryVessel | None", window: float
) -> "list[HeldOut]":
    """Predictions of the held-out runs, by the identified ship and by the start vessel."""
    from vessel_hsmc_ros.core import schema
    from vessel_hsmc_ros.scenario.own_ship import ship_of
    from vessel_hsmc_ros.studies.identification.page import HeldOut, steady_load
    from vessel_hsmc_ros.studies.identification.windows import predict

    before = schema.flatten(ship_of(start.values)) if start else {}
    hull = {name: float(before[name]) for name in found.values if name in before}  # type: ignore[arg-type]
    return [
        HeldOut(
            run,
            predict(found.values, run, window, found.inputs),
            predict(hull, run, window) if start else None,
            steady_load(found.values, run, window, found.inputs),
        )
        for run in unused
    ]


def _write(
    options: dict[str, Any],
    runs: "Sequence[Measurements]",
    found: "Identified",
    judged: "Sequence[HeldOut]",
    start: "LibraryVessel | None",
) -> None:
    """Write vessel file and page."""
    from vessel_hsmc_ros.report.page_kit import writing
    from vessel_hsmc_ros.studies.identification.page import errors, render, vessel_text

    name, output = options["name"], options["output"]
    known = _known(options, start, found.values)
    shown = {f"{each.run.name}, {key}": value for each in judged for key, value in errors(each.prediction).items()}
    text = vessel_text(name, found, runs, known, shown)
    page = render(name, runs, found, judged)
    for path, content in ((output / f"{name}.html", page), (output / f"{name}.yaml", text)):
        with writing(str(path)):
            path.write_text(content, encoding="utf-8")
        print_status(f"written: {path}")


def _print(runs: "Sequence[Measurements]", found: "Identified", judged: "Sequence[HeldOut]") -> None:
    """Print the parameters, the prediction errors, and what the runs do not determine."""
    from vessel_hsmc_ros.studies.identification.page import (
        ERRORS_HEAD,
        PARAMETERS_HEAD,
        errors_table,
        explanations,
        parameters_table,
    )

    print_table(PARAMETERS_HEAD[:5], [line[:5] for line in parameters_table(found)])
    print_table(ERRORS_HEAD, errors_table(runs, found, judged))
    for name, why in found.unidentifiable:
        print_line(f"{name} is held: {why}")
    for line in (*found.warnings, *explanations(found, judged)):
        print_warning(line)
