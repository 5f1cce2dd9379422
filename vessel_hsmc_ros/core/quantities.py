"""Numbers as people write them: three significant digits and the unit with an SI prefix, such as 200 kN or 0.75 mm.

The prefix is the one with which the number is below 1000 and at least 1; at least 0.1 for the unit itself and its parts. Angles,
shares and counts have none.
"""

import math

GREATER = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
SMALLER = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))

KINDS = {
    "N": (*GREATER, *SMALLER),
    "N·m": (*GREATER, *SMALLER),
    "m": ((1e3, "k"), *SMALLER),
    **dict.fromkeys(("s", "m/s", "m/s²", "rad/s", "rad/s²"), SMALLER),
}
"""The units that take prefixes, with those that are usual: seconds and speeds have none above one."""

CLOSE = ("°", "°/s")  # units that follow their number without a space


def scaled(value: float, unit: str) -> tuple[float, str]:
    """Choose the prefix for a value.

    `value`: in SI units; of the values of an axis, the one with the largest magnitude. `unit`: the SI unit. Returns the factor
    that converts SI values, and the unit with its prefix.
    """
    size = abs(_rounded(value))
    for scale, prefix in KINDS.get(unit, ()):
        # From 0.1 on for the unit itself and below, so that 0.75 mm and 0.5 m stay what they are.
        if (scale if scale > 1.0 else 0.1 * scale) * (1.0 - 1e-9) <= size < 1e6 * scale:
            return 1.0 / scale, prefix + unit
    return 1.0, unit


def quantity(value: float, unit: str = "", sign: bool = False) -> str:
    """A value with its unit, for people: `quantity(2e5, "N")` is `200 kN`.

    `value`: in SI units; angles in the given unit. `unit`: the unit without a prefix; empty for none. `sign`: whether a
    positive value has its sign too. Returns the text; a dash for a value that is not finite.
    """
    if not math.isfinite(value):
        return "–"
    factor, shown = scaled(value, unit)
    text = number(value * factor)
    text = f"+{text}" if sign and value > 0.0 else text
    return text + shown if shown in CLOSE else f"{text} {shown}".rstrip()


def number(value: float) -> str:
    """A number of three significant digits; those of an integer part below a million are not rounded."""
    value = _rounded(value) if abs(value) < 1000.0 else value
    return f"{value:.0f}" if 1000.0 <= abs(value) < 1e6 else f"{value:.3g}"


def number_of(text: str) -> float:
    """The number that a text from a file or a command line contains."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{text} is not a number")
    return float(text)


def _rounded(value: float) -> float:
    """The value to three significant digits, so that 999.9996 N is 1 kN and not 1000 N; zero has no sign."""
    return float(f"{value:.3g}") + 0.0


def in_noise(error: float, noise: float) -> str:
    """A position error in words, relative to the standard deviation of the measured positions, both m."""
    return f"{number(error / noise)} of the {quantity(noise, 'm')} of noise of its positions"
