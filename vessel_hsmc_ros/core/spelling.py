"""Output in an encoding that lacks characters, such as ASCII in the C locale: those of units and equations are spelled out."""

import codecs

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
"""How characters are written where the encoding of the output lacks them; any other becomes a question mark."""

HANDLER = "spell"
"""Name of the error handler of `str.encode` that spells characters out."""


def spelled(text: str, encoding: str) -> str:
    """A text with the characters that an encoding lacks spelled out, for output whose columns are aligned."""
    return text.encode(encoding, HANDLER).decode(encoding)


def _spell(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(SPELLINGS.get(character, "?") for character in missing), error.end


codecs.register_error(HANDLER, _spell)
