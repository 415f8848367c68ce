"""``blossom bench paper``: rows, means, tables, pictures, resuming, and what goes wrong."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest

from models.goals import goal_path
from planner.fold_plan import MachineLimits
from planner.fold_problem import RULES
from planner.motion_baselines import FOLD_METHODS
from studio.bench_cases import VARIANTS, BenchSettings, Case, Row, run_case, without_of
from studio.bench_paper import find_meshes, paper_cases, read_rows, run_bench
from studio.bench_pictures import pictures
from studio.bench_tables import PAPER_PERCENT, area_ratio, case_mean, common_meshes, headline, markdown
from studio.cli import main
from studio.errors import OutputError, UsageError
from studio.progress import Progress

SETTINGS = BenchSettings(
    limits=MachineLimits(), planners=("first-block", "linear"), variants=("all", "flips"), size_mm=None,
    max_faces=348, net_budget_s=1.0, budgets_s={"mp": 0.1},
)  # fmt: skip
QUIET = Progress(quiet=True)


@pytest.fixture(autouse=True)
def usual_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")  # a command keeps the width of its first message


def row(mesh="a", net="nb", planner="fp", variant="all", completion=1.0, area=10.0, seed=0, status="ok"):
    return Row(mesh, 12, "closed", seed, net, planner, variant, status, completion, 0.5, area, 3, 2, 0.1)


def some_rows():
    return [
        row("a", "nb", completion=1.0, area=10.0), row("a", "nb", completion=0.8, area=30.0, seed=1),
        row("a", "ga", completion=0.5, area=50.0), row("a", "ga", completion=0.7, area=50.0, seed=1),
        row("b", "nb", completion=0.6, area=5.0), row("b", "ga", completion=None, area=None, status="no net"),
        row("a", "nb", "mp", completion=0.4), row("a", "ga", "mp", completion=0.1),
        row("a", "nb", variant="flips", completion=0.25), row("a", "nb", "linear", completion=0.5, area=None),
    ]  # fmt: skip


def test_means_are_over_meshes_each_the_mean_over_its_seeds():
    mean, with_plan, tried = case_mean(some_rows(), "nb", "fp", "all")
    assert mean == pytest.approx(((1.0 + 0.8) / 2 + 0.6) / 2)
    assert (with_plan, tried) == (2, 2)
    assert case_mean(some_rows(), "ga", "fp", "all") == (pytest.approx(0.6), 1, 2)
    assert case_mean(some_rows(), "ga", "fp", "all", missing_is_zero=True) == (pytest.approx(0.3), 1, 2)
    assert case_mean(some_rows(), "nb", "rrt-connect", "all") == (None, 0, 0)


def test_the_ratio_of_areas_counts_pairs_that_both_have_a_plan():
    assert area_ratio(some_rows(), "fp") == (pytest.approx((10.0 + 30.0) / (50.0 + 50.0)), 2)
    assert area_ratio([row(area=0.0), row(net="ga", area=0.0)], "fp") == (None, 1)
    assert area_ratio([], "fp") == (None, 0)


def test_headline_stands_beside_the_paper():
    figures = headline(some_rows())
    assert figures["NB + FP"]["paper_percent"] == 96.08
    assert figures["GA + FP"]["mean_percent_missing_as_zero"] == pytest.approx(30.0)
    assert figures["clipped area NB : GA"]["percent"] == pytest.approx(40.0)
    assert figures["NB + linear"]["paper_percent"] is None
    assert sorted(PAPER_PERCENT.values()) == [13.31, 46.87, 75.47, 96.08]


def test_methods_are_also_compared_on_the_meshes_that_all_fold():
    rows = [r for r in some_rows() if r.planner == "fp"]
    assert common_meshes(rows, [("nb", "fp"), ("ga", "fp")]) == {"a"}
    assert headline(rows)["NB + FP"]["mean_percent_on_common_meshes"] == pytest.approx(90.0)


def test_page_names_failures_and_the_command():
    page = markdown(some_rows(), SETTINGS, "blossom bench paper --seeds 2")
    assert "`blossom bench paper --seeds 2`" in page
    assert "| NB + FP | 96.08 | 75.00 |" in page
    assert "b, ga: no net in 1 rows" in page
    assert "**40.0 %**" in page
    assert "| flips | 25.00 |" in page
    assert markdown([], SETTINGS, "x").count("None.") == 1


def test_pictures_are_svg_with_a_bar_or_dot_for_each_figure():
    drawn = pictures(some_rows())
    assert set(drawn) == {"paper-means.svg", "paper-meshes.svg", "paper-rules.svg"}
    for text in drawn.values():
        ElementTree.fromstring(text)  # noqa: S314  our own text
    dots = ElementTree.fromstring(drawn["paper-meshes.svg"]).iter("{http://www.w3.org/2000/svg}circle")  # noqa: S314
    assert len(list(dots)) == 5  # those that the paper has too
    assert pictures([]) == {}
    assert "<b>" not in "".join(pictures([row("<b>")]).values())


def test_a_case_has_a_row_for_each_planner_and_variant():
    rows = run_case(Case(goal_path("bracket"), "nb", 3), SETTINGS)
    assert [(r.planner, r.variant) for r in rows] == [
        ("first-block", "all"), ("first-block", "flips"), ("linear", "all"),
    ]  # fmt: skip
    assert {(r.status, r.kind, r.seed, r.completion) for r in rows} == {("ok", "open", 3, 1.0)}
    assert rows[2].clipped_area_mm2 is None
    assert run_case(Case(goal_path("bracket"), "nb", 0), replace(SETTINGS, max_faces=3)) == []


def test_no_net_no_mesh_and_no_plan_are_rows(tmp_path):
    (tmp_path / "broken.obj").write_text("v 0 0 nonsense\n")
    broken = run_case(Case(tmp_path / "broken.obj", "nb", 0), SETTINGS)
    assert {r.status for r in broken} == {"bad mesh"}
    assert len(broken) == 3
    overlapping = run_case(Case(goal_path("creature_coarse"), "bfs", 0), SETTINGS)
    assert {r.status for r in overlapping} == {"no net"}
    assert all(r.reason and r.completion is None for r in overlapping)
    low = replace(SETTINGS, limits=MachineLimits(axis_height=20.0), variants=("all",))
    refused = run_case(Case(goal_path("box_with_lid"), "nb", 0), low)
    assert {r.planner: r.status for r in refused} == {"first-block": "no plan", "linear": "ok"}
    assert "bed" in refused[0].reason


def test_rows_come_back_from_the_file_and_a_run_goes_on(tmp_path):
    cases = paper_cases([goal_path("bracket")], ["nb"], 2)
    first = run_bench(cases[:1], SETTINGS, tmp_path, command="one", progress=QUIET)
    assert read_rows(tmp_path / "paper.csv") == first
    with pytest.raises(OutputError, match="--resume"):
        run_bench(cases, SETTINGS, tmp_path, command="two", progress=QUIET)
    both = run_bench(cases, SETTINGS, tmp_path, command="two", resume=True, progress=QUIET)
    assert both[: len(first)] == first
    assert {r.seed for r in both} == {0, 1}
    assert read_rows(tmp_path / "paper.csv") == both
    assert "`two`" in (tmp_path / "paper.md").read_text()


def test_a_case_that_was_cut_off_is_run_again(tmp_path):
    cases = paper_cases([goal_path("bracket")], ["nb"], 1)
    whole = run_bench(cases, SETTINGS, tmp_path, command="x", progress=QUIET)
    text = (tmp_path / "paper.csv").read_bytes().splitlines(keepends=True)
    (tmp_path / "paper.csv").write_bytes(b"".join(text[:2]) + text[2][:20])
    again = run_bench(cases, SETTINGS, tmp_path, command="x", resume=True, progress=QUIET)
    assert [replace(r, seconds=0.0) for r in again] == [replace(r, seconds=0.0) for r in whole]
    assert len(read_rows(tmp_path / "paper.csv")) == len(whole)


def test_ctrl_c_leaves_rows_tables_and_no_processes(tmp_path, monkeypatch):
    cases = paper_cases([goal_path("bracket"), goal_path("flower")], ["nb"], 1)

    def stop_at_the_second(case, settings):
        if case.mesh.stem == "flower":
            raise KeyboardInterrupt
        return run_case(case, settings)

    monkeypatch.setattr("studio.bench_paper.run_case", stop_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        run_bench(cases, SETTINGS, tmp_path, command="x", progress=QUIET)
    assert {r.mesh for r in read_rows(tmp_path / "paper.csv")} == {"bracket"}
    assert "bracket" in (tmp_path / "paper.md").read_text()


def test_several_processes_give_the_rows_of_one(tmp_path):
    cases = paper_cases([goal_path("bracket"), goal_path("box_with_lid")], ["nb"], 1)
    one = run_bench(cases, SETTINGS, tmp_path / "one", command="x", progress=QUIET)
    two = run_bench(cases, SETTINGS, tmp_path / "two", command="x", jobs=2, progress=QUIET)
    assert {replace(r, seconds=0.0) for r in one} == {replace(r, seconds=0.0) for r in two}


def test_meshes_are_found_in_folders_and_by_name(tmp_path):
    folder = goal_path("flower").parent
    found = find_meshes([folder])
    assert goal_path("flower") in found
    assert all(path.suffix == ".obj" for path in found)
    assert find_meshes([goal_path("flower")]) == [goal_path("flower")]
    with pytest.raises(UsageError, match="no such file"):
        find_meshes([tmp_path / "nowhere"])
    with pytest.raises(UsageError, match="no mesh"):
        find_meshes([tmp_path])


def test_variants_are_rules_of_the_planner():
    rules = {rule for variant in VARIANTS for rule in without_of(variant)}
    assert rules == set(RULES) - {"outside-in", "side"}
    assert {planner for _, planner in PAPER_PERCENT} <= set(FOLD_METHODS)


def test_the_command_writes_tables_and_prints_json(tmp_path, capsys):
    line = ["bench", "paper", "--meshes", str(goal_path("bracket")), "--seeds", "1", "--nets", "nb"]
    line += ["--planners", "fp", "linear", "--variants", "all", "-o", str(tmp_path / "out"), "--json"]
    assert main(line) == 0
    figures = json.loads(capsys.readouterr().out)["headline"]
    assert figures["NB + FP"]["mean_percent"] == pytest.approx(100.0)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "paper.csv", "paper.md", "paper-means.svg", "paper-meshes.svg",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--nets", "nib"], "did you mean nb"),
        (["--planners", "linaer"], "did you mean linear"),
        (["--meshes", "nowhere"], "no such file or folder"),
        (["--tilt", "80"], "tilts by 0 to"),
        (["--seeds", "0"], "above 0"),
    ],
)
def test_mistakes_in_usage(options, words, capsys, tmp_path):
    assert main(["bench", "paper", "-o", str(tmp_path / "out"), *options]) == 2
    assert words in capsys.readouterr().err
