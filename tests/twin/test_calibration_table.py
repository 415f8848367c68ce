"""Tables as people and spreadsheets write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.calibration_table import COLUMNS, CalibrationTable, read_table, table_text
from twin.errors import CalibrationError

HEAD = "power_w,speed_mm_s,spot_mm,passes,angle_deg\n"


def read(folder: Path, text: str | bytes, **more: float) -> CalibrationTable:
    path = folder / "strip.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, **more)


def test_a_plain_table(tmp_path):
    table = read(tmp_path, HEAD + "9,100,0.1,5,3.25\n11,200,0.1,10,8\n")
    first, second = table.rows
    assert (first.line, first.power_w, first.passes, first.angle_deg) == (2, 9.0, 5, 3.25)
    assert first.setting == (9.0, 100.0, 0.1, None) and first.start_c == 20.0
    assert second.line == 3 and table.notes == () and table.name == "strip.csv"


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + HEAD + "9,100,0.1,5,3.25\n",
        (HEAD + "9,100,0.1,5,3.25\n").replace(",", ";").replace(".", ","),
        (HEAD + "9,100,0.1,5,3.25\n").replace(",", "\t"),
        "# burnt on a Tuesday\r\n\r\n" + HEAD.upper() + ' 9 ,"100",0.1,5.0, 3.25 \r\n,,,,\r\n',
        "angle_deg,passes,spot_mm,note,speed_mm_s,power_w\n3.25,5,0.1,fine,100,9\n",
    ],
)
def test_ways_of_writing_the_same(tmp_path, text):
    (row,) = read(tmp_path, text).rows
    assert (row.power_w, row.speed_mm_s, row.spot_mm, row.passes, row.angle_deg) == (9, 100, 0.1, 5, 3.25)


def test_rows_without_an_angle_are_left_out_and_named(tmp_path):
    table = read(tmp_path, HEAD + "9,100,0.1,5,\n9,100,0.1,10,3\n9,100,0.1,20,  \n")
    assert len(table.rows) == 1 and "2 rows without an angle are left out (lines 2, 4)" in table.notes


def test_repeats_and_copies_are_told(tmp_path):
    table = read(tmp_path, HEAD + "9,100,0.1,5,3\n9,100,0.1,5,3.1\n9,100,0.1,5,3.1\n")
    assert table.notes[0] == "2 rows repeat a setting and count as repeats"
    assert table.notes[1].startswith("1 of them have the same angle too")


def test_the_spot_may_be_given_beside_the_table(tmp_path):
    text = "power_w,speed_mm_s,passes,angle_deg\n9,100,5,3\n"
    assert read(tmp_path, text, spot_mm=0.12).rows[0].spot_mm == 0.12
    with pytest.raises(CalibrationError, match=r"spot_mm is missing \(or give --spot\)"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("\n# only a remark\n", "empty"),
        (HEAD, "no row has a measured angle"),
        (HEAD + "9,100,0.1,5,\n", "no row has a measured angle"),
        (HEAD + "9,100,0.1,5,about three\n", "line 2, column angle_deg: 'about three' is not a number"),
        (HEAD + "9,fast,0.1,5,3\n", "line 2, column speed_mm_s: 'fast'"),
        (HEAD + "9,100,0.1,5,nan\n", "line 2, column angle_deg: nan is out of range"),
        (HEAD + "inf,100,0.1,5,3\n", "column power_w: inf is out of range"),
        (HEAD + "-9,100,0.1,5,3\n", "column power_w: -9 is out of range, expected 0.001 to 100000"),
        (HEAD + "0,100,0.1,5,3\n", "column power_w"),
        (HEAD + "9,100,0.1,2.5,3\n", "passes: 2.5 is not a whole number"),
        (HEAD + "9,100,0.1,5,-3\n", "column angle_deg: -3"),
        (HEAD + "9,100,0.1,5,400\n", "expected 0 to 180"),
        (HEAD + "9,100,,5,3\n", "line 2, column spot_mm: is empty"),
        (HEAD + "9,5,100,0,1,5,3,25\n", "8 cells under a heading of 5 columns: were numbers written with"),
        ("power_w,speed_mm_s,spot_mm,angle_deg\n9,100,0.1,3\n", "column passes is missing"),
        ("power_w," + HEAD + "9,9,100,0.1,5,3\n", "column power_w comes twice"),
        ("id," + HEAD + "a,9,100,0.1,5,3\na,9,100,0.1,5,3\n", "line 3: id a was on line 2 already"),
        (b"PK\x03\x04\x00\x00", "not a text file"),
        (b"power_w\xff\xfe", "not UTF-8 text"),
    ],
)
def test_mistakes_are_named_with_their_place(tmp_path, text, words):
    with pytest.raises(CalibrationError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value) and "strip.csv" in str(caught.value)


def test_no_file_and_a_folder_are_named(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(CalibrationError, match="cannot read the table"):
            read_table(path)


def test_a_table_to_fill_in_reads_back(tmp_path):
    text = table_text(
        [(1, 9.0, 100.0, 0.1, 0.1, 5, 20, 3.5, "a, note"), (2, 9.0, 50.0, 0.1, 0.1, 5, 20, "", "")]
    )
    assert text.splitlines()[0] == ",".join(COLUMNS)
    table = read(tmp_path, text)
    assert len(table.rows) == 1 and table.rows[0].thickness_mm == 0.1
