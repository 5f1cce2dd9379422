"""`vessel-hsmc report`: a page, figures and tables from recorded bags."""

from pathlib import Path
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_metrics
from vessel_hsmc_ros.cli.options import file_option, namespace_option, topic_options
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.hull import DrawnHull


@click.command()
@click.argument("bags", nargs=-1, required=True, metavar="RUN...", type=click.Path(path_type=Path))
@file_option("Path of the page [default: report.html in the run folder].")
@click.option("--title", help="Title of the page.")
@namespace_option
@topic_options
@click.option("--figures", type=click.Choice(["png", "svg"]), help="Also save the figures, in figures/ beside the page.")
@click.option("--csv", is_flag=True, help="Also export all signals as CSV, into csv/ beside the page.")
@click.option("--parquet", is_flag=True, help="Also export all signals as Parquet, if pyarrow is installed.")
@click.option("--hull-length", type=float, help="Length of the drawn hull, m [default: of the recorded ship].")
@click.option("--hull-beam", type=float, help="Beam of the drawn hull, m [default: of the recorded ship].")
def report(
    bags: tuple[Path, ...], hull_length: float | None, hull_beam: float | None, output: Path | None, **options: Any
) -> None:
    """Make a page with diagrams from recordings: run folders or bags.

    It shows the vessel on its track beside its reference, linked diagrams of all signals, metrics, parameters and versions.
    Several bags are overlaid, with a table of the differences from the first. The page of a bag outside a run folder is
    NAME_report.html beside it.
    """
    from vessel_hsmc_ros.report import rows  # imports the report's libraries
    from vessel_hsmc_ros.report.making import Options, make

    hull = schema.build(DrawnHull, {"length": hull_length or 0.0, "beam": hull_beam or 0.0}, "hull")
    made = make(bags, Options(page=output, hull=hull, **options))
    print_metrics([(record.name if len(made.records) > 1 else "", rows(record.metrics, record.facts)) for record in made.records])
    for what, path in made.files.items():
        print_line(f"{what}: {path}")
