"""Figures by class: each scene in one class, aims met or not, tables of what records hold."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("bpy")

from occlusion_bake.bench.pages import ROOT
from occlusion_bake.bench.versus import class_page, page, record
from occlusion_bake.bench.versus.bakers import CYCLES, OURS_ERROR, OURS_RAYS
from occlusion_bake.bench.versus.class_figures import aims, by_scene
from occlusion_bake.bench.versus.classes import BRACKETED, CLASSES, SIZE, size_of
from occlusion_bake.bench.versus.record import Point, Record, Run
from occlusion_bake.samples.bench_scenes import EVERY, FROM_MODELS, HIGH_TO_LOW, MANY, MODELS, OWN_SIZES

ABOUT = {
    "object": "Thing",
    "texels": 100,
    "triangles": 10,
    "reference_rays": 4096,
    "measured": "2026-11-30",
    **dict.fromkeys(("machine", "blender", "embree", "embreex", "open3d"), "?"),
}


def made_up(scene: str, times: float, *, plain: float = 3.0, told: float = 1.0, map_: str = "ao") -> Record:
    """Seconds as RMSE⁻² of all: Cycles takes `times` as long as ours, and ours plain `plain` times."""
    points = []
    for baker, factor in ((OURS_ERROR, 1.0), (CYCLES, times), (OURS_RAYS, plain)):
        for parts in (40, 50, 100, 255, 510):
            run = Run(factor * (parts / 50) ** 2, 1 / parts, 0.0, 2 / parts, 100, told / parts, 2 / parts, 800)
            points.append(Point(baker, f"1/{parts}" if baker == OURS_ERROR else str(parts**2), [run]))
    kept = [each for each in points if map_ == "ao" or each.baker != CYCLES]
    return Record(scene, size_of(scene), dict(ABOUT), 1e-6, {}, kept, map_)


def test_every_scene_is_in_one_class() -> None:
    assert sorted(scene for kind in CLASSES for scene in kind.scenes) == sorted(EVERY)
    assert len({kind.name for kind in CLASSES}) == len(CLASSES)


def test_what_is_said_of_scenes_is_of_scenes_that_there_are() -> None:
    assert {*BRACKETED, *OWN_SIZES, *HIGH_TO_LOW, *MANY} <= set(EVERY)
    assert len(BRACKETED) >= 4
    assert set(FROM_MODELS.values()) <= set(MODELS)
    assert next(kind.scenes for kind in CLASSES if kind.name == "high_to_low") == HIGH_TO_LOW


def test_aims_are_met_where_every_scene_is_measured_and_fast_enough() -> None:
    found = by_scene([made_up(scene, 1.01 * kind.least) for kind in CLASSES for scene in kind.scenes])
    of_classes = aims(found)[: len(CLASSES)]
    assert [each.met for each in of_classes] == ["yes"] * len(CLASSES)
    del found["spot"]
    assert aims(found)[0].met == "not all measured"
    found["spot"] = by_scene([made_up("spot", 59.0)])["spot"]
    assert aims(found)[0].met == "no"
    assert aims(found)[0].measured == "worst 59, `spot`"


def test_the_mean_over_all_is_geometric() -> None:
    mean = aims(by_scene([made_up("spot", 100.0), made_up("gaps", 400.0)]))[len(CLASSES)]
    assert mean.measured == "200, 2 scenes"
    assert mean.met == "not all measured"
    assert aims(by_scene([made_up("spot", 100.0), made_up("gaps", 390.0)]))[len(CLASSES)].met == "no"


def test_one_goal_at_which_ours_is_slower_than_plain_is_told() -> None:
    slower, truly = aims(by_scene([made_up("spot", 100.0), made_up("gaps", 400.0, plain=0.5)]))[-2:]
    assert (slower.met, truly.met) == ("no", "yes")
    # All four are equal, and which of them is the least by rounding is the processor's.
    assert re.fullmatch(r"worst 0\.5, `gaps` at 1/\d+; 4 of 8 slower", slower.measured)
    assert aims(by_scene([made_up("spot", 100.0)]))[-2].met == "yes"


def test_an_error_told_too_small_is_told() -> None:
    truly = aims(by_scene([made_up("spot", 100.0, told=0.7), made_up("gaps", 400.0)]))[-1]
    assert truly.met == "no"
    assert truly.measured == "0.70, `spot` at 1/50, to 1.00, `gaps` at 1/510; 4 of 8 outside"


def test_a_goal_that_ours_does_not_reach_is_an_aim_missed() -> None:
    coarse = made_up("spot", 1000.0)
    coarse.points = [each for each in coarse.points if each.baker != OURS_ERROR or int(each.setting[2:]) <= 100]
    found = aims(by_scene([coarse]))
    assert found[0].measured == "not reached: `spot`"
    assert found[0].met == found[-2].met == "no"


def test_tables_have_a_row_a_scene_and_those_of_all() -> None:
    lines = class_page.chapter([made_up("spot", 100.0), made_up("bunny", 25.0), made_up("gaps", 400.0)])
    at = lines.index("### Scanned and character meshes")
    assert lines[0] == f"## By class, {SIZE}x{SIZE}"
    assert lines[at + 4 : at + 8] == [
        "| `bunny` | Cycles | 25 | 25 | 25 | 25 |",
        "| `spot` | Cycles | 100 | 100 | 100 | 100 |",
        "| geometric mean | Cycles | 50 | 50 | 50 | 50 |",
        "| worst | Cycles | 25, `bunny` | 25, `bunny` | 25, `bunny` | 25, `bunny` |",
    ]
    assert "| `spot` | told / made | 1.00 | 1.00 | 1.00 | 1.00 |" in lines
    of_all = lines[lines.index("### All scenes") :]
    assert "| geometric mean | Cycles | 100 | 100 | 100 | 100 |" in of_all
    assert not any(line.startswith("| `") for line in of_all)


def test_figures_are_of_the_class_size_and_of_a_scene_s_own() -> None:
    small = made_up("spot", 10.0)
    small.size = SIZE // 2
    assert by_scene([small]) == {}
    assert set(by_scene([small], trial=True)) == {"spot"}
    assert made_up("igea_low", 70.0).size == OWN_SIZES["igea_low"]
    assert set(by_scene([made_up("igea_low", 70.0)])) == {"igea_low"}


def test_reflections_stand_beside_plain_alone() -> None:
    records = [made_up("spot", 100.0), *(made_up("spot", 0.0, map_=name) for name in ("ro_100", "ro_10"))]
    lines = class_page.reflections(records)
    assert [line for line in lines if line.startswith("## ")] == ["## RO 10 by class", "## RO 100 by class"]
    assert sum(line.startswith("| `spot` | ours plain |") for line in lines) == 2
    assert not any("Cycles" in line for line in lines)


def test_a_page_is_made_of_whatever_there_is() -> None:
    records = [made_up("spot", 100.0), made_up("props", 100.0), made_up("gaps", 1.0, map_="ro_10")]
    lines = page.lines_of(records, [["## Section", "", "Text."]])
    headings = [line for line in lines if line.startswith("## ")]
    assert headings[0] == f"## By class, {SIZE}x{SIZE}"
    assert headings.index("## RO 10 by class") < headings.index("## Scenes") < headings.index("## Section")
    assert f"## Times as long as ours at equal RMSE, {OWN_SIZES['props']}x{OWN_SIZES['props']}" not in headings
    assert "### props, 128x128" in lines
    assert not any("{" in line for line in lines)


def test_records_that_are_kept_can_be_read() -> None:
    kept = record.records(trial=False)
    files = {each.file for each in kept}
    assert files and all(file.exists() for file in files)
    assert files == set((ROOT / "bench" / "results").glob("*_*[0-9].json"))
    assert {each.scene for each in kept} <= set(EVERY)
