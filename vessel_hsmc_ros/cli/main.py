"""The entry point of `vessel-hsmc`: it prepares signals and standard streams before it imports the command."""

import io
import os
import sys

from vessel_hsmc_ros.cli.interrupts import exit_at_interrupt, ignore_interrupts


def main() -> int:
    """Run the command as this process; returns its exit code."""
    exit_at_interrupt()
    # Imported from here on, during which the user may press Ctrl-C: the command takes a second.
    from vessel_hsmc_ros.core.exceptions import InstallationError
    from vessel_hsmc_ros.core.install_paths import require

    if os.environ.get("COLUMNS") == "0":  # a terminal of unknown width, in which tables would be empty
        del os.environ["COLUMNS"]
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # where its encoding lacks a character, such as that of a unit
    try:
        require("click", "numpy", "rich", "yaml")
        from vessel_hsmc_ros.cli.command import execute

        return execute()
    except InstallationError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    finally:
        ignore_interrupts()


if __name__ == "__main__":
    sys.exit(main())
