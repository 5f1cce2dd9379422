"""`vessel-hsmc tune`: search the gains of a law with the smallest cost over a scenario, a suite or a campaign."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_status, print_table, progress_bar
from vessel_hsmc_ros.cli.options import law_file_option, parse_changes, set_option
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder

if TYPE_CHECKING:
    from vessel_hsmc_ros.studies.tuning.result import Result


@click.command()
@click.argument("source", metavar="SCENARIO|SUITE|CAMPAIGN")
@click.option("--law", help="The law to tune [default: that of the scenario].")
@click.option(
    "--gain",
    "gains",
    multiple=True,
    required=True,
    metavar="NAME[=LOW:HIGH[:log]]",
    help="A gain, such as controller.guided.position_gain=0.05:0.5:log; without a range, a decade around its present value. An"
    " asterisk stands for any part of the name. May be given several times.",
)
@click.option("--trials", type=click.IntRange(min=1), default=100, show_default=True, help="Number of trials.")
@click.option(
    "--metric", default="position_error_rms_last_quarter", show_default=True, help="Metric of the cost, as in run.json."
)
@click.option(
    "--second-metric",
    help="Metric of the effort, such as yaw_moment_rms, which is minimised too: the result is a front of trade-offs.",
)
@click.option(
    "--aggregate",
    type=click.Choice(["geometric_mean", "worst"]),
    default="geometric_mean",
    show_default=True,
    help="How the metrics of several runs become one cost.",
)
@click.option("--held-out", metavar="SCENARIO|SUITE|CAMPAIGN", help="Runs to evaluate the result on [default: other seeds].")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of the search.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Number of parallel runs [default: one per core for 100 runs or more a trial, else 1].",
)
@set_option
@law_file_option
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder of the tuning; one that exists is continued [default: a new one in runs].",
)
def tune(
    source: str,
    law: str | None,
    gains: Sequence[str],
    trials: int,
    held_out: str | None,
    seed: int,
    workers: int | None,
    changes: Sequence[str],
    output: Path | None,
    **objective: Any,
) -> None:
    """Search the gains of a law with the smallest cost over a scenario, the rows of a suite or the draws of a campaign.

    All trials use the same runs with the same noise. The command writes the gains as a parameters file (best.yaml), a page,
    pictures and a table of all trials. The same command with the same --output continues after an interruption, or with more
    --trials.
    """
    # Imported here: Optuna takes half a second, which the other verbs need not spend.
    from vessel_hsmc_ros.studies.tuning.files import write
    from vessel_hsmc_ros.studies.tuning.plan import LAW, Tuning, chosen_objective, held_out_cases, law_of, load_cases, parse_gains
    from vessel_hsmc_ros.studies.tuning.result import tune as run_tuning

    given = parse_changes(changes)
    runs = load_cases(source, given | ({} if law is None else {LAW: law}))
    law = law_of(runs)
    tuning = Tuning(runs, parse_gains(gains, law, runs[0].scenario), chosen_objective(**objective), seed, workers)
    unseen = held_out_cases(source if held_out is None else held_out, given, law, others=held_out is not None)
    folder = _folder(output, f"{Path(source).stem}_{law}_tune")
    again = "the same command" if output else f"the same command with --output {shlex.quote(str(folder))}"
    print_status(f"folder: {folder}; after an interruption {again} continues the search")
    with progress_bar(f"tuning {law} over {len(runs)} {'run' if len(runs) == 1 else 'runs'}", trials, "trials") as update:
        result = run_tuning(tuning, folder, trials, unseen, lambda done, best: update(done, note=best))
    _print(result)
    for kind, path in write(folder, result).items():
        print_line(f"{kind}: {path}")


def _folder(output: Path | None, name: str) -> Path:
    """The folder of a tuning: the given one, which may exist, or a new one."""
    if output is None:
        check_writable(Path("runs"))
        return make_run_folder(Path("runs"), name).path
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"folder {output} cannot be made: {error.strerror}") from None
    check_writable(output)
    return output


def _print(result: "Result") -> None:
    """Print present and tuned gains, and what the change is worth."""
    from vessel_hsmc_ros.studies.tuning.files import GAINS_HEAD, gains_table
    from vessel_hsmc_ros.studies.tuning.result import verdict

    print_table(GAINS_HEAD, gains_table(result))
    for line in verdict(result):
        print_line(line)
