"""The benchmark of nets, on shipped goals and on runs made by hand."""

from __future__ import annotations

import csv
from dataclasses import replace

from benchmarks.net_tables import Run, mesh_table, method_table, ratio_lines, seconds_text
from benchmarks.nets import main
from models.goals import goal_path

NB = Run("a", 120, 0, "nb", 0, True, 0, 6, "steepest", 0.1, None, 10)


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_command_writes_a_table_and_a_file(tmp_path, capsys):
    folder = goal_path("creature_coarse").parent
    path = tmp_path / "out" / "nets.csv"
    arguments = [
        "--meshes",
        str(folder),
        "--only",
        "creature_coarse",
        "--seeds",
        "2",
        "--seconds",
        "5",
        "--prove",
    ]
    assert main([*arguments, "--csv", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    row = dict(zip(cells(lines[0]), cells(lines[2]), strict=True))
    assert row["mesh"] == "creature_coarse"
    assert row["nb nets"] == "2/2"
    with path.open(newline="") as file:
        runs = list(csv.DictReader(file))
    assert {run["mesh"] for run in runs} == {"creature_coarse"}
    assert sum(run["method"] == "nb" for run in runs) == 2
    assert sum(run["method"] == "bfs" for run in runs) == 1
    exact = next(run for run in runs if run["method"] == "exact")
    assert int(exact["bound"]) <= int(exact["edits"])
    for run in runs:
        assert run["is_net"] == "False" or run["overlaps"] == "0"
    assert any(line.startswith("- 1 meshes where") for line in lines) == all(
        run["is_net"] == "True" for run in runs if run["method"] in ("nb", "ga")
    )


def test_nothing_to_run_is_said(tmp_path, capsys):
    assert main(["--meshes", str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err


def test_medians_rates_and_ratios():
    runs = [
        NB,
        replace(NB, seed=1, edits=8, seconds=0.3),
        replace(NB, method="ga", edits=20, seconds=1.0),
        replace(NB, method="ga", seed=1, edits=22, seconds=0.6),
        replace(NB, method="exact", edits=6, bound=6, seconds=2.0),
        replace(NB, method="bfs", is_net=False, overlaps=9),
        replace(NB, mesh="b", faces=20, seconds=0.2),
        replace(NB, mesh="b", faces=20, method="ga", is_net=False, overlaps=3, seconds=5.0),
        replace(NB, mesh="b", faces=20, method="ga", seed=1, seconds=4.0),
        replace(NB, mesh="b", faces=20, method="exact", edits=5, bound=3),
    ]
    head, _, first, second = (cells(line) for line in mesh_table(runs))
    one, two = dict(zip(head, first, strict=True)), dict(zip(head, second, strict=True))
    assert one["overlaps S / D / B"] == "– / – / 9"
    assert (one["nb nets"], one["nb edits"], one["nb s"]) == ("2/2", "7", "0.2")
    assert (one["fewest edits"], one["proof s"]) == ("S 6", "2.0")
    assert (one["ga nets"], one["ga edits"], one["ga s"]) == ("2/2", "21", "0.8")
    assert (two["ga nets"], two["ga edits"], two["ga s"]) == ("1/2 (3)", "6", "4.5")
    assert two["fewest edits"] == "S 3 to 5"
    assert one["random"] == "–"
    table = {cells(line)[0]: cells(line)[1:] for line in method_table(runs)[2:]}
    assert table["ga"] == ["2", "3 of 4 (75 %)", "1", "2.6", "5.0"]
    assert table["nb"] == ["2", "3 of 3 (100 %)", "2", "0.2", "0.3"]
    text = "\n".join(ratio_lines(runs))
    assert "1 meshes where every run of nb and ga finds a net: time nb : ga = 0.25" in text
    assert "fewest edits proven for 1 of 2 trees, widest gap 2; proven that there is no net for 0" in text
    assert "median 1, most 1, none on 0 of 2" in text


def test_a_bound_of_as_many_edits_as_faces_means_none():
    run = replace(NB, method="exact", is_net=False, overlaps=4, bound=120)
    assert cells(mesh_table([run])[2])[6] == "S none"
    assert cells(mesh_table([replace(run, bound=7)])[2])[6] == "S 7 to ?"
    assert "proven that there is no net for 1, neither net nor proof for 0" in ratio_lines([run])[0]


def test_seconds_keep_two_digits():
    assert [seconds_text(s) for s in (0.0123, 0.94, 1.26, 12.6)] == ["0.012", "0.94", "1.3", "13"]
