"""The entry point of `vessel-hsmc`: it prepares signals and standard streams before it imports the command."""

import io
import os
import sys

from vessel_hsmc_ros.cli.interrupts import handle_interrupts, ignore_interrupts


def main() -> int:
    """Run the command as this process; returns its exit code."""
    handle_interrupts()
    # Imported from here on, during which the user may press Ctrl-C: the command takes a second.
    from vessel_hsmc_ros.core.exceptions import InstallationError
    from vessel_hsmc_ros.core.install_paths import require

    prepare_streams()
    try:
        require("click", "numpy", "rich", "yaml")
        from vessel_hsmc_ros.cli.command import execute

        return execute()
    except InstallationError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    finally:
        ignore_interrupts()


def prepare_streams() -> None:
    """Open closed standard streams on /dev/null, and let the output spell out characters that its encoding lacks."""
    from vessel_hsmc_ros.core.spelling import HANDLER

    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def _open_closed_streams() -> None:
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # else the next file that is opened, such as a bag, would become this stream
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
    sys.stdin = sys.stdin or _null("r")
    sys.stdout = sys.stdout or _null("w")
    sys.stderr = sys.stderr or _null("w")


def _null(mode: str) -> io.TextIOWrapper:
    return io.TextIOWrapper(io.FileIO(os.devnull, mode), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
