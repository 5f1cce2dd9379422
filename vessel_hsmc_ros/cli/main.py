"""The entry point of `vessel-hsmc`: it prepares signals and standard streams before it imports the command.

At any moment Ctrl-C ends the command with one line and exit code 130, without a traceback.
"""

import io
import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130  # exit code after Ctrl-C: 128 plus the number of SIGINT, as in a shell
INTERRUPTED_LINE = "interrupted"

_CLEAR_LINE_AND_SHOW_CURSOR = "\r\x1b[K\x1b[?25h"


def handle_interrupts() -> None:
    """Let the first SIGINT raise KeyboardInterrupt, during an import end the process, and the second one end it anyway."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as in a background job of a script
        signal.signal(signal.SIGINT, _on_interrupt)
        sys.unraisablehook = _on_unraisable


def _on_interrupt(_number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGINT, _exit_at_once)
    # A module that is interrupted while it is imported may print a traceback from C, or turn the exception into another one.
    if _is_importing(frame):
        _exit_at_once()
    raise KeyboardInterrupt


def _is_importing(frame: FrameType | None) -> bool:
    """Whether the import system is among the callers of a frame."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _on_unraisable(unraisable: "sys.UnraisableHookArgs") -> None:
    """End the process if the exception of Ctrl-C occurred in a destructor, which cannot pass it on."""
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        _exit_at_once()
    sys.__unraisablehook__(unraisable)


def _exit_at_once(*_: object) -> None:
    # Without the standard streams, whose buffers may be in use. Worker processes and nodes end with their parent.
    restore = _CLEAR_LINE_AND_SHOW_CURSOR if os.isatty(2) else ""
    os.write(2, f"{restore}{INTERRUPTED_LINE}\n".encode())
    os._exit(INTERRUPTED)


def main() -> int:
    """Run the command as this process; returns its exit code."""
    handle_interrupts()
    # Imported from here on, during which the user may press Ctrl-C: the command takes a second.
    from vessel_hsmc_ros.core.exceptions import InstallationError
    from vessel_hsmc_ros.core.install_paths import require

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
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Python would print a traceback while it shuts down


if __name__ == "__main__":
    sys.exit(main())
