"""Mutations of bytes, each known by its seed."""

import random
import re

VALUES = (
    *b"nan -.inf .nan 1e400 -1e-320 2001-99-99 true ~ '' [] [[[[]]]] {} *a \" ,, 1_0 0 -1".split(),
    *b"0x\n!!int x\n&a [*a]\n!!python/object/apply:os.system [id]\n!!binary x\n<<: *a".split(b"\n"),
    *(b"0x" + b"f" * 5000, b"9" * 5000, b"\xff" * 4, b"\xff" * 8, b"\x7f" * 8, b"\x00\x00\x00\x80"),
    *(b"\x00", b"\t", b"\r", b"\n", b"\xe2\x80\xa8"),
)
"""What is put in: numbers at the edge, tags, aliases, lengths, line ends."""

NUMBER = re.compile(rb"(?<![\w.])-?\d+(\.\d*)?(e[-+]?\d+)?(?![\w.])")
LONGEST_TEXT = 20_000
"""Bytes within which numbers are replaced as a whole."""


def mutated(data: bytes, seed: int) -> bytes:
    """Some bytes with one to four mutations: bits, values, numbers, cuts, repetitions, exchanged parts."""
    chance = random.Random(seed)  # noqa: S311 - not for secrets
    found = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(found) + 1)
        end = min(len(found), at + chance.choice((1, 2, 4, 8, 30)))
        kind = chance.randrange(8)
        if kind == 0 and at < len(found):
            found[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            found[at:end] = chance.choice(VALUES)
        elif kind == 2:
            found[at:at] = chance.choice(VALUES)
        elif kind == 3:
            del found[at : at + chance.choice((1, 4, 100, 10_000))]
        elif kind == 4:
            found[at:at] = found[at:end] * chance.choice((1, 3, 200))
        elif kind > 5 and (numbers := list(NUMBER.finditer(found[:LONGEST_TEXT]))):
            found[slice(*chance.choice(numbers).span())] = chance.choice(VALUES)
        else:
            other = chance.randrange(len(found) + 1)
            found[at:end] = found[other : other + end - at]
    return bytes(found)
