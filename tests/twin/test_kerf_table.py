"""Kerfs from measured pieces and holes."""

from __future__ import annotations

import math

import pytest

from twin.errors import CalibrationError
from twin.kerf_table import KERF_COLUMNS, is_kerf_table, read_kerfs

HEAD = ",".join(KERF_COLUMNS) + "\n"


def read(folder, text):
    path = folder / "kerf.csv"
    path.write_text(text)
    assert is_kerf_table(path)
    return read_kerfs(path)


def test_width_from_piece_hole_or_both(tmp_path):
    kerfs = read(
        tmp_path,
        HEAD + "1,19,30,1,8,7.88,,\n2,19,30,1,8,,8.14,\n3,19,60,1,8,7.92,8.12,\n4,19,90,1,8,,,not through\n",
    )
    slow, quick, none = kerfs
    assert (slow.windows, slow.through) == (2, 2) and slow.kerf_mm == pytest.approx(0.13)
    assert slow.sigma_mm == pytest.approx(0.02 / math.sqrt(2.0))
    assert quick.kerf_mm == pytest.approx(0.10) and math.isnan(quick.sigma_mm)
    assert (none.windows, none.through) == (1, 0) and math.isnan(none.kerf_mm)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1,19,30,1,8,,,\n", "no piece and no hole was measured"),
        ("1,19,30,1,8,wide,,\n", "column piece_mm: 'wide' is not a number"),
        ("1,19,30,1,8,80,,\n", "column piece_mm: 80 is out of range, expected 4 to 12"),
        ("1,19,30,1,8,8.1,8.0,\n", "no wider than the piece"),
        ("1,19,,1,8,7.9,,\n", "column speed_mm_s: is empty"),
        ("1,19,30,1,8,7.9,,\n1,19,30,1,8,7.9,,\n", "id 1 was on line 2"),
    ],
)
def test_mistakes_are_named_with_their_place(tmp_path, row, words):
    with pytest.raises(CalibrationError) as caught:
        read(tmp_path, HEAD + row)
    assert words in str(caught.value) and "kerf.csv" in str(caught.value)


def test_a_table_of_creases_is_none_of_windows(tmp_path):
    path = tmp_path / "strip.csv"
    path.write_text("power_w;angle_deg\n")
    assert not is_kerf_table(path) and not is_kerf_table(tmp_path / "none.csv")
