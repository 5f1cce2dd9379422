"""Ctrl-C: at any moment it ends the command with one line and exit code 130, without a traceback."""

import os
import signal

INTERRUPTED = 130  # exit code after Ctrl-C: 128 plus the number of SIGINT, as in a shell
INTERRUPTED_LINE = "interrupted"

_CLEAR_LINE_AND_SHOW_CURSOR = "\r\x1b[K\x1b[?25h"


def exit_at_interrupt() -> None:
    """Let SIGINT end the process: a module that is interrupted while it is imported may print a traceback from C."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as in a background job of a script
        signal.signal(signal.SIGINT, _exit_at_once)


def raise_at_interrupt() -> None:
    """Let the first SIGINT raise KeyboardInterrupt, and the second one end the process, where `exit_at_interrupt` was called."""
    if signal.getsignal(signal.SIGINT) is _exit_at_once:
        signal.signal(signal.SIGINT, _on_interrupt)


def ignore_interrupts() -> None:
    """Ignore SIGINT from now on: the process exits anyway, and Python would print a traceback while it shuts down."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _on_interrupt(*_: object) -> None:
    signal.signal(signal.SIGINT, _exit_at_once)
    raise KeyboardInterrupt


def _exit_at_once(*_: object) -> None:
    # Without the standard streams, whose buffers may be in use. Worker processes and nodes end with their parent.
    restore = _CLEAR_LINE_AND_SHOW_CURSOR if os.isatty(2) else ""
    os.write(2, f"{restore}{INTERRUPTED_LINE}\n".encode())
    os._exit(INTERRUPTED)
