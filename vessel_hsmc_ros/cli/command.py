"""The command `vessel-hsmc`: its verbs and its exit codes."""

import click

from vessel_hsmc_ros.cli.call import call
from vessel_hsmc_ros.cli.campaign import campaign
from vessel_hsmc_ros.cli.compare import compare
from vessel_hsmc_ros.cli.console import print_error, print_status
from vessel_hsmc_ros.cli.demo import demo
from vessel_hsmc_ros.cli.excite import excite
from vessel_hsmc_ros.cli.gains import gains
from vessel_hsmc_ros.cli.goto import goto
from vessel_hsmc_ros.cli.identify import identify
from vessel_hsmc_ros.cli.init import init
from vessel_hsmc_ros.cli.interrupts import INTERRUPTED, INTERRUPTED_LINE
from vessel_hsmc_ros.cli.manoeuvres import manoeuvres
from vessel_hsmc_ros.cli.parameters import parameters
from vessel_hsmc_ros.cli.path import path
from vessel_hsmc_ros.cli.recover import recover
from vessel_hsmc_ros.cli.replay import replay
from vessel_hsmc_ros.cli.report import report
from vessel_hsmc_ros.cli.reproduce import reproduce
from vessel_hsmc_ros.cli.run import run
from vessel_hsmc_ros.cli.set import set_parameters
from vessel_hsmc_ros.cli.simulate import simulate
from vessel_hsmc_ros.cli.sweep import sweep
from vessel_hsmc_ros.cli.tune import tune
from vessel_hsmc_ros.cli.vessels import vessels
from vessel_hsmc_ros.cli.watch import watch
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.version import __version__

FAILED, WRONG_USE = 1, 2
"""Exit codes: the command failed; its arguments were wrong."""


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Simulate a ship under automatic control, record the run and analyse it.

    \b
    vessel-hsmc demo                      a first example, in two minutes
    vessel-hsmc run case2_tracking        a recorded simulation by ROS 2 nodes
    vessel-hsmc report runs/*/bag         a page with track, errors, forces and metrics
    vessel-hsmc COMMAND --help            the options of a command

    A SCENARIO describes a run: ship, environment, reference, control law. A BAG is the recording of a run. docs/glossary.md
    explains the other terms, docs/parameters.md lists all parameters.
    """  # noqa: D301 - the escape keeps click from joining the lines


for verb in (
    campaign,
    compare,
    demo,
    excite,
    gains,
    identify,
    init,
    manoeuvres,
    parameters,
    recover,
    replay,
    report,
    reproduce,
    run,
    simulate,
    sweep,
    tune,
    vessels,
):
    cli.add_command(verb)
for verb in (call, goto, path, set_parameters, watch):  # on running nodes
    cli.add_command(verb)


def execute() -> int:
    """Run the command on the arguments of this process; every error of this package becomes one line and an exit code."""
    try:  # not in standalone mode, where click itself would exit with its own codes
        cli(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.Abort:  # which click raises at Ctrl-C
        print_status(INTERRUPTED_LINE)
        return INTERRUPTED
    except VesselHsmcError as error:
        print_error(str(error))
        return WRONG_USE if isinstance(error, ParameterError | ScenarioError) else FAILED
    return 0
