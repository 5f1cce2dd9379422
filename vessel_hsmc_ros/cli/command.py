"""The command `vessel-hsmc`: its verbs and its exit codes."""

import difflib
import importlib
import warnings
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_error, print_status, print_warning
from vessel_hsmc_ros.cli.interrupts import INTERRUPTED, INTERRUPTED_LINE, raise_at_interrupt
from vessel_hsmc_ros.core.exceptions import BagWarning, NoBagError, ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.install_paths import PACKAGE, missing_module, require

GROUPS = {
    "Simulate a ship": {
        "demo": "Three control laws on one example, side by side, in one page.",
        "run": "Simulate a scenario by ROS 2 nodes and record it.",
        "simulate": "Simulate a scenario quickly, without ROS.",
        "scenarios": "List the scenarios, or print one to start from.",
        "vessels": "List the ships of the library, or show one of them.",
        "parameters": "List all parameters, or search them for a word.",
    },
    "Analyse": {
        "report": "Make a page with diagrams from recordings.",
        "replay": "Play a recording back, check it or repeat it.",
        "recover": "Repair a recording that was cut off or damaged.",
        "compare": "Compare control laws on scenarios, or recorded runs.",
        "sweep": "Simulate a scenario for each value of a parameter.",
        "campaign": "Simulate thousands of runs with drawn parameters.",
        "tune": "Search the gains of a law.",
        "gains": "Print the gains of a law, and its margins.",
        "certify": "Print what holds of the law near the reference.",
        "reproduce": "Repeat every case and figure of the paper.",
    },
    "Running vessels": {
        "watch": "Show the state of a running vessel.",
        "call": "Pause, resume, reset, enable, disable, stop or rearm.",
        "set": "Change parameters of a running vessel.",
        "goto": "Send a running vessel to a position.",
        "path": "Send a running vessel along waypoints.",
        "mission": "Show, write or send a mission of a planner or chart.",
    },
    "Your own boat": {
        "init": "Write a complete commented scenario for your ship.",
        "forecast": "Tell whether a boat can do a mission today.",
        "check": "Check the connection with a boat, line by line.",
        "manoeuvres": "Simulate turning circle, zig-zags and crash stop.",
        "excite": "Write manoeuvres for an identification.",
        "ardupilot": "Simulate the ship for ArduPilot's autopilot (SITL).",
        "identify": "Identify the hull data of a ship from recordings.",
    },
}

VERBS = {name: line for verbs in GROUPS.values() for name, line in verbs.items()}

MODULES = {
    **dict.fromkeys(("demo", "compare", "sweep", "campaign", "reproduce"), "comparing"),
    "forecast": "mission",
    **dict.fromkeys(("scenarios", "vessels", "parameters"), "listing"),
    **dict.fromkeys(("report", "replay", "recover"), "recordings"),
    **dict.fromkeys(("tune", "certify"), "gains"),
    **dict.fromkeys(("call", "set", "goto", "path"), "sailing"),
    **dict.fromkeys(("init", "check", "ardupilot"), "boat"),
    **dict.fromkeys(("manoeuvres", "excite", "identify"), "hull"),
}
"""The modules of verbs that share one; each of the others has one of its name."""

BAGS = ("lz4", "mcap", "rosbags", "zstandard")
PAGES = (*BAGS, "jinja2", "matplotlib", "plotly")
LIBRARIES = {
    **dict.fromkeys(("demo", "run", "simulate", "compare", "reproduce", "report"), PAGES),
    **dict.fromkeys(("campaign", "identify", "manoeuvres", "sweep"), (*PAGES, "scipy")),
    "tune": (*PAGES, "optuna", "scipy"),
    "forecast": (*PAGES, "defusedxml", "geographiclib", "scipy"),
    "mission": ("defusedxml", "geographiclib", "scipy"),
    "recover": ("lz4", "mcap", "zstandard"),
    "replay": BAGS,
    "scenarios": ("scipy",),
    "vessels": ("scipy",),
}
"""The modules that verbs import beside ROS, click, NumPy, PyYAML and rich."""


FAILED, WRONG_USE = 1, 2  # exit codes: the command failed; its arguments were wrong
HELP = ["-h", "--help"]


class Verbs(click.Group):
    """The verbs, each a function of its module.

    It is imported when it is called: the libraries of all together take as long to import as a short run.
    """

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """The names of all verbs."""
        return sorted(VERBS)

    def get_command(self, _ctx: click.Context, name: str) -> click.Command | None:
        """The verb with this name; None if there is none."""
        if name not in VERBS:
            return None
        module = importlib.import_module(f"vessel_hsmc_ros.cli.{MODULES.get(name, name)}")
        verb: click.Command = getattr(module, "set_parameters" if name == "set" else name)
        return verb

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The verbs by groups, each with a whole line."""
        for title, verbs in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([*verbs.items()])

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """The verb that is called; of an unknown one, those like it are named.

        Raises InstallationError if libraries that it needs are missing; its help needs none of them.
        """
        near = difflib.get_close_matches(args[0], VERBS, n=2)
        if args[0] not in VERBS and near:
            ctx.fail(f"there is no verb {args[0]!r}: did you mean {' or '.join(near)}?")
        if not {*HELP} & {*args}:
            require(*LIBRARIES.get(args[0], ()))
        found = super().resolve_command(ctx, args)  # imports the verb
        raise_at_interrupt()
        return found


@click.group(cls=Verbs, context_settings={"help_option_names": HELP})
@click.version_option(package_name=PACKAGE)
def cli() -> None:
    """Simulate a ship under automatic control, record the run and analyse it.

    \b
    vessel-hsmc demo                      a first example, in two minutes
    vessel-hsmc run case2_tracking        a recorded simulation by ROS 2 nodes
    vessel-hsmc report runs/*/bag         a page with track, errors and forces
    vessel-hsmc COMMAND --help            the options of a command

    A SCENARIO describes a run: ship, environment, reference, control law. A BAG is the recording of a run. docs/glossary.md
    explains the other terms, docs/parameters.md lists all parameters.
    """  # noqa: D301 - the escape keeps click from joining the lines


def show_warning(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """Print what concerns the user, such as a missing file, as a line; the rest as Python does."""
    if issubclass(category, BagWarning):
        print_warning(str(message))
    else:
        PYTHONS(message, category, *place, **more)


PYTHONS = warnings.showwarning


def execute() -> int:
    """Run the command on the arguments of this process; every error of this package becomes one line and an exit code."""
    warnings.showwarning = show_warning  # type: ignore[assignment]
    try:  # not in standalone mode, where click itself would exit with its own codes
        cli(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.Abort:  # which click raises at Ctrl-C
        print_status(INTERRUPTED_LINE)
        return INTERRUPTED
    except ModuleNotFoundError as error:  # a verb imports its libraries when it is called
        print_error(missing_module(error))
        return FAILED
    except OSError as error:  # such as that of a full disk, to which the output goes
        print_error(f"{error.filename or 'the output'}: {error.strerror or error}")
        return FAILED
    except VesselHsmcError as error:
        print_error(str(error))
        return WRONG_USE if isinstance(error, ParameterError | ScenarioError | NoBagError) else FAILED
    return 0
