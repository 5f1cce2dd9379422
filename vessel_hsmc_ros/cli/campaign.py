"""`vessel-hsmc campaign`: thousands of runs of a scenario with drawn parameters, and `campaign report`: what they show."""

import datetime
import shlex
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import LINE_PERIODS, print_files, print_line, print_status, progress_bar
from vessel_hsmc_ros.cli.options import file_option, law_file_option
from vessel_hsmc_ros.scenario.run_folder import check_writable

WINDOW = 30.0  # time over which the rate of the runs is measured, s
RUN = "run"  # the verb that is left out in `vessel-hsmc campaign FILE`


class CampaignGroup(click.Group):
    """A group whose verb `run` may be left out."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the verb where the first argument is none."""
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = [RUN, *args]
        return super().parse_args(ctx, args)


@click.group(cls=CampaignGroup)
def campaign() -> None:
    """Simulate a scenario thousands of times, with parameters drawn from distributions.

    \b
    vessel-hsmc campaign FILE.yaml      compute the runs; the same command goes on
                                        with a campaign that was interrupted
    vessel-hsmc campaign report FOLDER  a page with failures, quantiles, worst
                                        runs and the parameters that matter
    vessel-hsmc run --campaign FOLDER --run 48213
                                        repeat one run by the ROS 2 nodes

    docs/campaigns.md explains the format of FILE.
    """  # noqa: D301 - the escape keeps click from joining the lines


@campaign.command(RUN)
@click.argument("file")
@click.option("--output", type=click.Path(path_type=Path), help="Folder of the dataset [default: runs/<name of FILE>_campaign].")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes on this machine [default: one per core].")
@click.option(
    "--scheduler", default="", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786, whose workers compute."
)
@click.option("--runs", type=click.IntRange(min=1), help="Number of draws [default: that of FILE].")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all random numbers [default: that of FILE].")
@law_file_option
def run_file(file: str, output: Path | None, workers: int | None, scheduler: str, runs: int | None, seed: int | None) -> None:
    """Compute the runs of a campaign.

    FILE is a YAML file, a campaign that comes with the package, or the folder of a campaign to go on with. The same command
    again goes on with what is missing. Every run can be repeated from FILE and its number, whoever computed it.
    """
    if workers and scheduler:
        raise click.UsageError("give --workers for this machine or --scheduler for a cluster, not both")
    from vessel_hsmc_ros.studies.campaign.execute import default_folder, run_campaign  # imports the libraries of campaigns
    from vessel_hsmc_ros.studies.campaign.plan import Campaign

    plan = Campaign.load(file, runs, seed)
    folder = output or (Path(file) if Path(file).is_dir() else default_folder(plan))
    check_writable(folder)
    for note in plan.notes:
        print_status(note)
    title = f"campaign {plan.name}"
    with progress_bar(title, plan.runs, "runs") as update:
        run_campaign(file, folder, workers=workers, scheduler=scheduler, runs=runs, seed=seed, on_progress=Pace(title, update))
    print_line(f"{plan.runs} runs: {folder}")
    print_line(f"for a page with failures and quantiles: vessel-hsmc campaign report {shlex.quote(str(folder))}")


class Pace:
    """Rate of the runs and the time left, from the runs of the last half minute."""

    def __init__(self, title: str, update: Callable[..., None]) -> None:
        self._title, self._update = title, update
        self._recent: deque[tuple[float, float]] = deque()
        self._printed = time.monotonic()

    def __call__(self, done: float, total: int) -> None:
        """Show that a number of all runs is done."""
        now = time.monotonic()
        self._recent.append((now, done))
        while now - self._recent[0][0] > WINDOW:
            self._recent.popleft()
        since, before = self._recent[0]
        if done <= before:
            self._update(done)
            return
        rate = (done - before) / (now - since)
        line = ""
        if now > self._printed + LINE_PERIODS[1] and done < total:
            left = datetime.timedelta(seconds=round((total - done) / rate))
            line = f"{self._title}: {done:.0f} of {total} runs, {rate:.3g} runs/s, {left} left"
            self._printed = now
        self._update(done, line, note=f"{rate:.3g} runs/s")


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@file_option("Path of the page [default: report.html in FOLDER].")
def report(folder: Path, output: Path | None) -> None:
    """Make a page from the results of a campaign, complete or not.

    It shows failures with the interval of their probability, distributions and quantiles of the metrics, the laws on the same
    draws, which parameters matter, and the worst runs with the commands that repeat them. Its diagrams are saved as PNG files in
    figures/ beside the page, too.
    """
    from vessel_hsmc_ros.studies.campaign.report import make_report  # imports the libraries of campaigns

    words, files = make_report(folder, output)
    for sentence in words:
        print_line(sentence)
    print_files(files)


campaign.add_command(report)
