"""`vessel-hsmc campaign report`: what a campaign shows, in words, as a page and as figures."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import file_option


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@file_option("Path of the page [default: report.html in FOLDER].")
def report(folder: Path, output: Path | None) -> None:
    """Make a page from the results of a campaign, complete or not.

    It shows failures with the interval of their probability, distributions and quantiles of the metrics, the laws on the same
    draws, which parameters matter, and the worst runs with the commands that repeat them. Its diagrams are saved as PNG files in
    figures/ beside the page, too.
    """
    from vessel_hsmc_ros.campaign.report import make_report  # imports the libraries of campaigns

    words, files = make_report(folder, output)
    for sentence in words:
        print_line(sentence)
    for kind, path in files.items():
        print_line(f"{kind}: {path}")
