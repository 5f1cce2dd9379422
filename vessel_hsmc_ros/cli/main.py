"""The command `vessel-hsmc`: its verbs and its exit codes."""

import sys

import click

from vessel_hsmc_ros.cli.compare import compare
from vessel_hsmc_ros.cli.console import print_error
from vessel_hsmc_ros.cli.demo import demo
from vessel_hsmc_ros.cli.parameters import parameters
from vessel_hsmc_ros.cli.recover import recover
from vessel_hsmc_ros.cli.replay import replay
from vessel_hsmc_ros.cli.report import report
from vessel_hsmc_ros.cli.reproduce import reproduce
from vessel_hsmc_ros.cli.run import run
from vessel_hsmc_ros.cli.simulate import simulate
from vessel_hsmc_ros.cli.sweep import sweep
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.version import __version__

FAILED, WRONG_USE, INTERRUPTED = 1, 2, 130
"""Exit codes: the command failed; its arguments were wrong; Ctrl-C, 128 plus the number of SIGINT as in a shell."""


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Hierarchical sliding-mode control of underactuated ships: run, record and analyse."""


for verb in (compare, demo, parameters, recover, replay, report, reproduce, run, simulate, sweep):
    cli.add_command(verb)


def main() -> int:
    """Run the command; every error of this package becomes one line and an exit code."""
    try:  # not in standalone mode, where click itself would exit with its own codes
        cli(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.Abort:
        return INTERRUPTED
    except VesselHsmcError as error:
        print_error(str(error))
        return WRONG_USE if isinstance(error, ParameterError | ScenarioError) else FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main())
