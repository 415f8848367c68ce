"""Reading a line of G-code as Grbl 1.1 does, with its error numbers."""

from __future__ import annotations

import math
import re

__all__ = ["GrblError", "Words", "read_words"]

Words = list[tuple[str, float]]
_WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))?")
_COMMENT = re.compile(r"\([^)]*\)?|;.*")


class GrblError(Exception):
    """The line is answered with ``error:<code>``."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def clean_line(line: str) -> str:
    """The line without comments and blanks, in capitals."""
    return "".join(_COMMENT.sub("", line).split()).upper()


def read_words(line: str) -> Words:
    """Words of a cleaned line.

    Raises:
        GrblError: 1 where a letter is missing, 2 where a number is bad.
    """
    words: Words = []
    place = 0
    while place < len(line):
        match = _WORD.match(line, place)
        if match is None:
            raise GrblError(1)
        if match[2] is None:
            raise GrblError(2)
        value = float(match[2])
        if not math.isfinite(value):
            raise GrblError(2)
        words.append((match[1], value))
        place = match.end()
    return words
