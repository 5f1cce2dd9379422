"""The entry point of `vessel-hsmc`: it prepares signals and standard streams before it imports the command."""

import sys

from vessel_hsmc_ros.cli.interrupts import handle_interrupts, ignore_interrupts
from vessel_hsmc_ros.cli.streams import prepare_streams
from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.install_paths import require


def main() -> int:
    """Run the command as this process; returns its exit code."""
    handle_interrupts()
    prepare_streams()
    try:
        require("click", "numpy", "rich", "yaml")
        from vessel_hsmc_ros.cli.command import execute  # takes a second, during which the user may press Ctrl-C

        return execute()
    except InstallationError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    finally:
        ignore_interrupts()


if __name__ == "__main__":
    sys.exit(main())
