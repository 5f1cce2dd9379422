"""Ctrl-C: at any moment it ends the command with one line and exit code 130, without a traceback."""

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


def ignore_interrupts() -> None:
    """Ignore SIGINT from now on: the process exits anyway, and Python would print a traceback while it shuts down."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


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
