"""The page of a ship's manoeuvres, a single HTML file without external resources; their metrics as CSV; their scenarios."""

import csv
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.manoeuvres.diagrams import figure
from vessel_hsmc_ros.manoeuvres.run import Results
from vessel_hsmc_ros.manoeuvres.tables import APPLIES, SOURCE, TITLES, UNITS, criteria, hull_data, notes, rows, source
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.scenario.scenario import dump_scenario


def write(folder: Path, results: Results) -> dict[str, Path]:
    """Write manoeuvres.html, manoeuvres.csv and a scenario for each manoeuvre, which the nodes can run, into an existing folder.

    Args:
        folder: The folder.
        results: The manoeuvres of a ship.

    Returns:
        The files by kind.

    Raises:
        ReportError: a file cannot be written.
    """
    files = {"page": folder / "manoeuvres.html", "metrics": folder / "manoeuvres.csv", "scenarios": folder / "scenarios"}
    try:
        files["scenarios"].mkdir(exist_ok=True)
        for name, done in results.manoeuvres.items():
            (files["scenarios"] / f"{name}.yaml").write_text(dump_scenario(done.scenario), encoding="utf-8")
        write_csv(files["metrics"], results)
        files["page"].write_text(render(results, files["scenarios"]), encoding="utf-8")
    except OSError as error:
        raise ReportError(f"results in {folder} cannot be written: {error.strerror}") from None
    return files


def write_csv(path: Path, results: Results) -> None:
    """Write a row for each metric: manoeuvre, metric, value in SI units and degrees, unit, in lengths, limit of its criterion."""
    length = results.ship.length
    limits = {(each.manoeuvre, each.metric): each.limit for each in criteria(length, results.ship.speed)}
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["manoeuvre", "metric", "value", "unit", "in_lengths", "limit", "complete"])
        for name, done in results.manoeuvres.items():
            for metric, value in done.metrics.items():
                unit = UNITS[metric]
                lengths = value / length if unit == "m" else ""
                writer.writerow([name, metric, value, unit, lengths, limits.get((name, metric), ""), done.complete])


def render(results: Results, scenarios: Path) -> str:
    """Render the HTML text of the page.

    Args:
        results: The manoeuvres of a ship.
        scenarios: The folder of their scenarios, for the command that runs one over the nodes.
    """
    ship, lines = results.ship, rows(results)
    figures = {name: drawn for name, done in results.manoeuvres.items() if (drawn := figure(done))}
    about = [subtitle(results), *([f"Hull data: {published}"] if (published := source(results)) else [])]
    return page_kit.render(
        "manoeuvres/manoeuvres.html",
        f"Standard manoeuvres: {ship.name}",
        about,
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "manoeuvres/manoeuvres.js"),
        content={"figures": figures},
        titles=TITLES,
        manoeuvres=results.manoeuvres,
        notes={name: list(notes(done)) for name, done in results.manoeuvres.items()},
        rows={name: [row for row in lines if row.manoeuvre == name] for name in results.manoeuvres},
        judged=[row for row in lines if row.limit],
        hull=hull_data(results),
        figures=figures,
        scenarios=scenarios,
        criteria=SOURCE,
        applies=APPLIES,
    )


def subtitle(results: Results) -> str:
    """The ship and its test speed in a line."""
    ship = results.ship
    limits = f"up to {quantity(ship.largest_force, 'N')} and {quantity(ship.largest_moment, 'N·m')}"
    speeds = f"test speed {quantity(ship.speed, 'm/s')} of {quantity(ship.top_speed, 'm/s')}"
    return f"{quantity(ship.length, 'm')} long · {limits} · {speeds} · still water, first turn to starboard"
