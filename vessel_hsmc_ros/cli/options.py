"""Arguments and options that several verbs take, and what they lead to: a scenario, a row of a campaign, running nodes."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import yaml
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from vessel_hsmc_ros.cli.console import print_error, print_line, print_warning
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.scenario.law_file import OPTION, load_law_file
from vessel_hsmc_ros.scenario.parameters_file import read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, read_changes, scenario_names
from vessel_hsmc_ros.scenario.warnings import check_effects, check_scenario
from vessel_hsmc_ros.simulation import compilation

if TYPE_CHECKING:
    from vessel_hsmc_ros.nodes.remote import Remote
    from vessel_hsmc_ros.studies.campaign.dataset import Row
    from vessel_hsmc_ros.studies.scenario_run import Result


def complete_scenario(_context: click.Context, _argument: click.Parameter, typed: str) -> list[CompletionItem]:
    """What a shell offers for a scenario: the names that begin with what is typed, and files."""
    names = [CompletionItem(name) for name in scenario_names() if name.startswith(typed)]
    return [*names, CompletionItem(typed, type="file")]


scenario_argument = click.argument("scenario", shell_complete=complete_scenario)

optional_scenario_argument = click.argument("scenario", required=False, shell_complete=complete_scenario)

json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")


def print_json(content: object) -> None:
    """Print a result for programs; a number that is not finite is null."""
    finite = json.loads(
        json.dumps(content, default=float), parse_constant=lambda _: None
    )  # a number of NumPy is none of Python's
    click.echo(json.dumps(finite, indent=1, ensure_ascii=False))


workers_option = click.option("--workers", type=click.IntRange(min=1), help="Number of parallel runs [default: one per core].")

rate_option = click.option("--rate-hz", type=float, help="Rate of the laws, Hz [default: that of the scenario].")

bag_argument = click.argument("bag", type=click.Path(path_type=Path))


def changes_option(name: str, argument: str, help_text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make an option of changed parameters, which a verb takes as values by `node.parameter`."""

    def parse(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> dict[str, object]:
        return parse_changes(texts, name)

    return click.option(name, argument, multiple=True, metavar="NODE.PARAM=VALUE", help=help_text, callback=parse)


set_option = changes_option(
    "--set",
    "changes",
    "Set a parameter, such as controller.law=guided; vessel.PARAM sets one of the ship for all nodes; @FILE sets all"
    " parameters in a ROS parameters file. May be given several times.",
)


def _load_law_files(_context: click.Context, _option: click.Parameter, paths: tuple[Path, ...]) -> None:
    for path in paths:
        load_law_file(path)


law_file_option = click.option(
    OPTION,
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Python file with a control law of your own; may be given several times.",
    callback=_load_law_files,
    expose_value=False,
    is_eager=True,
)
"""Registers the laws before the verb starts, which therefore takes no argument for it."""


def _interpret(_context: click.Context, _option: click.Parameter, wanted: bool) -> None:
    if wanted:
        compilation.disable()


interpreted_option = click.option(
    "--interpreted",
    is_flag=True,
    help="Run the laws interpreted instead of compiled: the results are the same, but take a hundred times as long.",
    callback=_interpret,
    expose_value=False,
)
"""Takes effect before the verb starts, which therefore takes no argument for it."""

output_option = click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("runs"),
    show_default=True,
    help="Folder in which a new folder for the results is created.",
)


no_page_option = click.option("--no-page", is_flag=True, help="Write no page and no figures, which take seconds.")


def file_option(help_text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make an option `--file` for the one file that a verb writes, which takes it as `output`."""
    return click.option("--file", "output", type=click.Path(path_type=Path, dir_okay=False), metavar="PATH", help=help_text)


def folder_option(help_text: str, default: Path | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make an option `--output` for the folder itself that a verb writes into."""
    return click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=default, help=help_text)


def refuse_without(needed: str, *names: str) -> None:
    """Refuse options of the verb that runs, which are given without what they go with, and so would have no effect.

    `needed`: what they go with, such as `--live`. Raises click.UsageError if one of them is given.
    """
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"--{name.replace('_', '-')} goes with {needed}")


namespace_option = click.option("--namespace", help="ROS namespace of the vessel, if a bag holds several vessels.")


def topic_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options --odometry and --wrench to a verb that reads bags of boats with topics of other names."""
    for name, what in (("--wrench", "wrench on the hull"), ("--odometry", "odometry")):
        text = f"Topic of the {what} in a bag, if it is not found by name or type."
        command = click.option(name, metavar="TOPIC", default="", help=text)(command)
    return command


vessel_option = click.option("--namespace", default="", help="ROS namespace of the vessel.")


NAMESPACE = re.compile(r"([A-Za-z_]\w*(/[A-Za-z_]\w*)*)?", re.ASCII)


def checked_namespace(namespace: str) -> str:
    """A namespace without slashes at its ends. Raises ParameterError if it is not a ROS namespace."""
    namespace = namespace.strip("/")
    if not NAMESPACE.fullmatch(namespace):
        raise ParameterError(f"namespace must be names of letters, digits and _, separated by / (got {namespace})")
    return namespace


def load_checked(name: str, changes: Mapping[str, object], varied: bool = False) -> Scenario:
    """Load a scenario, and print a warning for each thing in it that is probably not what was meant.

    `varied`: whether its runs vary further parameters, which may give effect to settings that have none in the scenario. Raises
    ScenarioError, ParameterError as `load_scenario`.
    """
    scenario = load_scenario(name, changes)
    effects = [] if varied else check_effects(scenario, changes)
    for line in [*check_scenario(scenario), *effects]:
        print_warning(line)
    return scenario


def parse_changes(changes: Iterable[str], option: str = "--set") -> dict[str, object]:
    """Parse texts of the form `node.param=value`, with the value in YAML, or `@FILE` for all values of a ROS parameters file.

    Raises ParameterError if a text has no equals sign, or its value is not YAML; ScenarioError if a file cannot be read.
    """
    parsed: dict[str, object] = {}
    for change in changes:
        if change.startswith("@"):
            parsed |= read_changes(Path(change[1:]))
            continue
        key, equals, value = change.partition("=")  # at the first one: a regular expression may contain more
        if not equals:
            raise ParameterError(f"{option} must be node.param=value (got {change})")
        if not value.strip():
            raise ParameterError(f"{option} must have a value after the equals sign, '' for an empty text (got {change})")
        try:
            parsed[key.strip()] = read_yaml(value)
        except yaml.YAMLError:
            raise ParameterError(f"{option} must have a YAML value after the equals sign (got {change})") from None
    return parsed


DIFFERENT = 1  # exit code of a run that differs from its row


def campaign_row_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a verb, which takes them as `campaign` and `row`."""
    folder = click.option(
        "--campaign",
        type=click.Path(path_type=Path),
        help="Folder of a campaign of which --run selects a run, instead of SCENARIO.",
    )
    number = click.option("--run", "row", type=click.IntRange(min=0), metavar="N", help="Number of the run in the campaign.")
    return folder(number(command))


def of_row(scenario: str | None, folder: Path | None, number: int | None, changed: bool) -> "Row | None":
    """The row that the options select; None where they are not given.

    `changed`: whether other options would change the run. Raises click.UsageError if neither a scenario nor a row is selected,
    or more than a row; ParameterError, CampaignError as `Row.read`.
    """
    if folder is None and number is None:
        if scenario is None:
            raise click.UsageError("Missing argument 'SCENARIO'; or give --campaign and --run")
        return None
    if folder is None or number is None or scenario is not None or changed:
        without = "SCENARIO, --set, --real-time and --faults"
        raise click.UsageError(f"to repeat a run of a campaign give --campaign and --run, without {without}")
    from vessel_hsmc_ros.studies.campaign.dataset import Row  # imports the libraries of campaigns

    return Row.read(folder, number)


def compare_with_row(row: "Row", result: "Result") -> int:
    """Print whether a run has the metrics of its row; returns the exit code."""
    if not row.values:
        print_line(f"row {row.run} of the campaign is not computed yet: nothing to compare with")
        return result.exit_code
    differences = row.differences(result.metrics, result.failure)
    for line in differences:
        print_error(f"row {row.run}: {line}")
    if not differences:
        what = "the run ended early as" if row.values["ended_early"] else "all metrics are bit-identical to those of"
        print_line(f"{what} row {row.run} of the campaign")
    return DIFFERENT if differences else 0


@contextmanager
def running_vessel(namespace: str) -> Iterator["Remote"]:
    """A connection with the nodes in a namespace.

    Raises ParameterError if the namespace is not one of ROS; InstallationError if two installations of ROS would mix; RunError
    if ROS is not installed.
    """
    from vessel_hsmc_ros.nodes.ros_environment import check_ros  # imported here: most verbs need no ROS

    checked = checked_namespace(namespace)
    check_ros()
    try:
        from vessel_hsmc_ros.nodes.remote import Remote
    except ModuleNotFoundError as error:
        raise RunError(missing_module(error)) from None
    with Remote(checked) as remote:
        yield remote
