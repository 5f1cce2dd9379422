"""The verbs on the hull of a ship: `manoeuvres`, `excite` and `identify`."""

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import yaml

from vessel_hsmc_ros.cli.console import print_files, print_line, print_status, print_table, print_warning, progress_bar, write_new
from vessel_hsmc_ros.cli.options import (
    file_option,
    folder_option,
    interpreted_option,
    namespace_option,
    output_option,
    set_option,
    topic_options,
)
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import shell_command
from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.parameters_file import tree
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names
from vessel_hsmc_ros.studies.manoeuvres.run import PLANS

if TYPE_CHECKING:
    from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
    from vessel_hsmc_ros.studies.identification.page import HeldOut
    from vessel_hsmc_ros.studies.identification.types import Identified, Measurements
    from vessel_hsmc_ros.studies.manoeuvres.run import Results


@click.command()
@click.argument("ships", nargs=-1, metavar="[VESSEL|SCENARIO]...")
@click.option(
    "--only",
    "kinds",
    multiple=True,
    type=click.Choice(tuple(PLANS)),
    metavar="MANOEUVRE",
    help=f"One of {', '.join(PLANS)}; may be given several times.",
)
@click.option("--markdown", is_flag=True, help="Print the table of all ships in Markdown, and write no files.")
@set_option
@interpreted_option
@output_option
def manoeuvres(ships: Sequence[str], kinds: Sequence[str], markdown: bool, changes: dict[str, object], output: Path) -> None:
    """Simulate the standard manoeuvres of a ship: turning circle, zig-zags, spiral, crash stop, speed runs, bollard pull.

    The ship is a VESSEL of the library, a vessel file, or the ship of a SCENARIO, whose other parameters are not used. Without an
    argument all vessels of the library are simulated. The water is calm. The run folder receives a page with tracks and metrics,
    the metrics as CSV, and a scenario for each manoeuvre, which `vessel-hsmc run` takes.
    """
    from vessel_hsmc_ros.studies.manoeuvres import page  # imports the libraries of reports
    from vessel_hsmc_ros.studies.manoeuvres.run import run, ship_named

    named = list(ships or vessel_names())
    scaled = [ship_named(name, changes) for name in named]
    if not markdown:
        check_writable(output)
    wanted = list(kinds or PLANS)
    found = []
    with progress_bar("manoeuvres", len(scaled) * len(wanted), "manoeuvres") as update:
        for k, ship in enumerate(scaled):

            def show(name: str, number: int, _total: int, done: int = k * len(wanted), of: str = ship.name) -> None:
                update(done + number, f"{of}: {page.TITLES[name]} ...")

            found.append(run(ship, wanted, show))
    if markdown:
        head, lines = page.overview(found)
        for line in (head, ["---"] * len(head), *lines):
            print_line(f"| {' | '.join(line)} |")
        return
    if len(found) > 1:
        print_table(*page.overview(found))
    for name, results in zip(named, found, strict=True):
        if len(found) == 1:
            print_results(results)
        print_files(page.write(make_run_folder(output, f"{Path(name).stem}_manoeuvres").path, results))


def print_results(results: "Results") -> None:
    """Print the metrics of a ship, a table for each manoeuvre, with what one must know to judge them."""
    from vessel_hsmc_ros.studies.manoeuvres.page import APPLIES, HEAD, SOURCE, TITLES, notes, rows

    for name, done in results.manoeuvres.items():
        print_table(HEAD, [row.cells for row in rows(results) if row.manoeuvre == name], title=TITLES[name])
        for note in notes(done):
            print_line(note)
    print_line(f"Criteria: {SOURCE}; {APPLIES}.")


@click.command()
@click.argument("ship", metavar="VESSEL|SCENARIO")
@file_option("The scenario to write [default: NAME_excite.yaml].")
def excite(ship: str, output: Path | None) -> None:
    """Write a scenario of manoeuvres from which `identify` can determine a ship's hull data.

    VESSEL is a vessel of the library or a vessel file. SCENARIO is a scenario or its file, such as one that `vessel-hsmc init`
    has written. The hull data need not be exact: they only scale forces and times. The scenario commands surge force and yaw
    moment without feedback. Simulate it, or sail it with your own boat and record a bag, and pass the bag to
    `vessel-hsmc identify`. The command prints the manoeuvres and the space that they need.
    """
    from vessel_hsmc_ros.simulation.offline import simulate
    from vessel_hsmc_ros.studies.identification.excitation import HEAD, excitation, scenario_text, space, table

    data, section = _ship(ship)
    scale = scale_of(data)
    steps = excitation(scale)
    path = output or Path(f"{Path(ship).stem}_excite.yaml")
    text = scenario_text(path.stem, f"ship {Path(ship).stem}", section, scale, steps)
    run = simulate(parse_scenario(text, path.stem, source="the new scenario"))
    write_new(path, text)
    print_table(HEAD, table(steps, run))
    print_line(space(run))
    simulate_it = f"{shell_command()} simulate {shlex.quote(str(path))}"
    print_line(f"scenario: {path}; next: {simulate_it}, or sail it; then {shell_command()} identify on the bag")


def _ship(name: str) -> "tuple[ShipParameters, str]":
    """The ship of a vessel or of a scenario, and the section `vessel` that describes it in a new scenario."""
    from vessel_hsmc_ros.studies.manoeuvres.run import is_vessel

    is_file = Path(name).suffix in (".yaml", ".yml")
    if is_vessel(name):
        values: dict[str, object] = dict(read_vessel(name).values)
        section = {"vessel": name} if not is_file else tree(values)
    elif is_file or name in scenario_names():
        values = _hull_data(load_scenario(name).vessel_sim.vessel)
        section = tree(values)
    else:
        raise ScenarioError(
            f"{name} is neither a vessel nor a scenario: it must be one of {', '.join(vessel_names())}, or a file"
        )
    text = yaml.safe_dump(section, sort_keys=False, default_flow_style=None)
    return ship_of(values), "\n".join(f"    {line}" for line in text.splitlines())


def _hull_data(ship: "ShipParameters") -> dict[str, object]:
    """The data of a ship by their dotted names, without those that have no meaning for it."""
    entries = schema.entries(type(ship))
    return {
        f"vessel.{key}": value
        for key, value in schema.flatten(ship).items()
        # A coefficient of zero is written: left out, it would be that of the paper's ship.
        if key != "name" and (value != entries[key].default or (isinstance(value, float) and math.isfinite(value)))
    }


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
@namespace_option
@topic_options
@click.option(
    "--column", "columns", multiple=True, metavar="NAME=COLUMN", help="Column of the CSV files, such as surge_force=Fx."
)
@click.option("--window", type=float, default=20.0, show_default=True, metavar="s", help="Length of a simulated window.")
@click.option("--name", default="identified", show_default=True, help="Name of the vessel and of its file.")
@folder_option("Folder of the files, which replace those of an earlier identification [default: this one].", Path())
def identify(
    data: Sequence[Path],
    names: str,
    vessel: str | None,
    length: float | None,
    beam: float | None,
    held_out: Sequence[Path],
    columns: Sequence[str],
    window: float,
    name: str,
    output: Path,
    **topics: Any,
) -> None:
    """Identify the hull data of a ship from bags or CSV files of its motion.

    A bag holds odometry and the applied or commanded wrench; a CSV file the columns time, x, y, heading (or heading_deg),
    surge_force, yaw_moment, and u, v, r where measured. Writes NAME.yaml, a vessel that scenarios and `vessel-hsmc init`
    take, and NAME.html, which shows measured against simulated motion and how well each parameter is known.
    """
    from vessel_hsmc_ros.studies.identification import estimate, study  # imports the libraries of reports
    from vessel_hsmc_ros.studies.identification.types import MODELS, model

    chosen = model(names if names in MODELS or "_" not in names else tuple(part.strip() for part in names.split(",")))
    start = None if vessel is None else read_vessel(vessel)
    named = _columns(columns)
    if again := {path.resolve() for path in data} & {path.resolve() for path in held_out}:
        raise ParameterError(f"--held-out must be a run that the estimation does not use (got {min(again)})")
    runs, unused = ([study.measured(path, named, topics) for path in paths] for paths in (data, held_out))
    sizes = {key: value for key, value in (("length", length), ("beam", beam)) if value is not None}
    target = study.Target(name, output, start, sizes)
    target.check()
    known = ship_of(start.values) if start else None
    with progress_bar(f"identifying {name}", 100.0, "%") as update:
        found = estimate.identify(runs, chosen, known, window, lambda what, done: update(100.0 * done, note=what))
    judged = study.judged(unused, found, start, window)
    for path in target.write(runs, found, judged):
        print_status(f"written: {path}")
    _print(runs, found, judged)
    print_line(f"next: vessel-hsmc init NAME --vessel {shlex.quote(str(target.file))}")


def _columns(given: Sequence[str]) -> dict[str, str]:
    """Columns of the CSV files by what they hold."""
    for text in given:
        if "=" not in text:
            raise ParameterError(f"--column must be NAME=COLUMN (got {text})")
    return {name: column for name, _, column in (text.partition("=") for text in given)}


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
