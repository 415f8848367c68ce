"""What a controller says after a beam block about its modes, feed and power, against what it was sent.

Grbl's lines carry no checksum. A damaged feed or mode can leave place and number of answers right; the modal
state that ``$G`` reports afterwards still tells it.
"""

from __future__ import annotations

from collections.abc import Sequence

from rigs.gate import split_words

__all__ = ["modes_mistake"]

_EXPECTED = ("G21", "G90", "G94", "G54", "M5")


def modes_mistake(lines: Sequence[str], report: Sequence[str]) -> str | None:
    """What ``$G`` says otherwise than the lines of a block, in words, or None.

    Args:
        lines: of the block, as they were sent.
        report: the lines of the answer, ``[GC:G0 G54 … F600 S500]``; empty where a firmware has none.
    """
    words = next((line[4:-1].split() for line in report if line.startswith("[GC:")), None)
    if words is None:
        return None
    for mode in _EXPECTED:
        if mode not in words:
            return f"the controller should be in {mode}, it reports {' '.join(words)}"
    have = {word[0]: float(word[1:]) for word in words if word[0] in "FS" and _is_number(word[1:])}
    sent: dict[str, float] = {}
    for line in lines:
        sent.update({letter: value for letter, value in split_words(line) or () if letter in "FS"})
    for letter, value in sent.items():
        shown = have.get(letter)
        if shown is None or abs(shown - value) > 0.6 + 1e-3 * value:  # reports are rounded
            what = "nothing" if shown is None else f"{letter}{shown:g}"
            return f"the controller worked with {what}, it was sent {letter}{value:g}"
    return None


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdigit()
