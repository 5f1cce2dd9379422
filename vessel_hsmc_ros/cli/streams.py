"""Standard streams that can be closed, or whose encoding lacks characters."""

import codecs
import io
import os
import sys

SPELLINGS = {
    "²": "^2",
    "³": "^3",
    "·": "*",
    "°": " deg",
    "±": "+-",
    "×": "x",
    "…": "...",
    "–": "-",
    "—": "-",
    "ψ": "psi",
    "τ": "tau",
}
"""How characters of the output are written where the terminal's encoding lacks them, as in the C locale."""


def prepare_streams() -> None:
    """Open closed standard streams on /dev/null, and let the output spell out characters that its encoding lacks."""
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="spell")


def spelled(text: str, encoding: str) -> str:
    """A text with the characters that an encoding lacks spelled out, for output whose columns are aligned."""
    return text.encode(encoding, "spell").decode(encoding)


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


def _spell(error: UnicodeError) -> tuple[str, int]:
    """An error handler of `codecs`: replace characters that cannot be encoded."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(SPELLINGS.get(character, "?") for character in missing), error.end


codecs.register_error("spell", _spell)
