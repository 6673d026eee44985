"""What a command of the bench means, which points it measures, and when it stops."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from occlusion_bake.bench.versus import __main__ as command
from occlusion_bake.bench.versus.bakers import CYCLES, OURS, OURS_ERROR, PEERS, Baker
from occlusion_bake.bench.versus.cases import Case, cases, is_meant, is_trial
from occlusion_bake.bench.versus.choice import BRACKET_SECONDS, bakers_for, longest
from occlusion_bake.bench.versus.classes import BRACKET_SIZE, BRACKETED, CLASSES
from occlusion_bake.bench.versus.measure import _expected, _is_at_its_end
from occlusion_bake.bench.versus.record import Point, Record, Run
from occlusion_bake.samples.bench_scenes import MODELS, OWN_SIZES, SCENES


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A folder that holds all models, by their names."""
    for file in MODELS.values():
        (tmp_path / file).touch()
    return tmp_path


def chosen_by(words: str, models: Path) -> argparse.Namespace:
    """As the command reads them."""
    parser = command._parser()
    parser.add_argument("sections", nargs="*")
    parser.add_argument("--models", type=Path)
    return parser.parse_args([*shlex.split(words), "--models", str(models)])


def meant_by(words: str, models: Path) -> list[str]:
    """The names of what is measured."""
    chosen = chosen_by(words, models)
    return [
        name
        for name in command._names(chosen)
        if not chosen.sections or any(is_meant(name, word) for word in chosen.sections)
    ]


def a_baker(models: Path, name: str, case: Case, words: str = "") -> Baker:
    return next(each for each in bakers_for(case, chosen_by(words, models)) if each.name == name)


def points(*rmse: float) -> list[Point]:
    return [Point(CYCLES, str(4**power), [Run(4.0**power, each, 0.0, 0.0, 1)]) for power, each in enumerate(rmse)]


@pytest.mark.parametrize("case", [Case("igea_low", 2048), Case("igea", 512, "ro_10"), Case("igea", 512, "ro_100")])
def test_a_case_is_found_again_by_its_name(case: Case) -> None:
    assert Case.named(case.name) == case


def test_sections_are_no_cases() -> None:
    assert [Case.named(name) for name in command.SECTIONS] == [None] * len(command.SECTIONS)


def test_a_scene_is_not_another_whose_name_begins_so(models: Path) -> None:
    assert meant_by("igea", models) == ["igea_512", "igea_1024"]
    assert meant_by("igea_low props", models) == ["props_128", "igea_low_2048"]


def test_all_is_every_scene_at_all_sizes_or_its_own_and_the_sections(models: Path) -> None:
    names = meant_by("", models)
    alike = [name for name in (*SCENES, *MODELS) if name not in OWN_SIZES]
    assert {f"{name}_{size}" for name in alike for size in (512, 1024)} <= set(names)
    assert {f"{name}_{size}" for name, size in OWN_SIZES.items()} | set(command.SECTIONS) <= set(names)
    assert len(names) == 2 * len(alike) + len(OWN_SIZES) + len(command.SECTIONS)


def test_classes_and_maps_choose(models: Path) -> None:
    wanted = next(kind.scenes for kind in CLASSES if kind.name == "hard_surface")
    assert set(meant_by("--classes hard_surface --sizes 512", models)) == {f"{name}_512" for name in wanted}
    assert set(meant_by("--classes hard_surface --sizes 512 --maps ro_10", models)) == {
        f"{name}_ro_10_512" for name in wanted
    }


def test_what_is_only_tried_is_tried_at_the_size_asked_for(models: Path) -> None:
    assert meant_by("igea_low --sizes 512", models) == ["igea_low_2048"]
    assert meant_by("igea_low --sizes 512 --bakers ours", models) == ["igea_low_512"]
    assert meant_by("igea_low --quick", models) == ["igea_low_256"]
    assert meant_by("--quick", models) == ["suzanne_256", "gaps_256"]


def test_a_check_is_of_what_it_names_alone(models: Path) -> None:
    words = "igea --sizes 1024 --bakers ours,cycles --errors 1/255"
    chosen = chosen_by(words, models)
    (case,) = [each for each in cases(chosen) if each.scene == "igea"]
    ours, cycles = bakers_for(case, chosen)
    assert is_trial(chosen)
    assert (ours.name, ours.settings, ours.further) == (OURS_ERROR, ("1/255",), ())
    assert (cycles.name, cycles.settings, cycles.until) == (CYCLES, (), 1 / 255)
    assert cycles.further[:2] == ("1", "4") and cycles.further[-1] == "4096"


@pytest.mark.parametrize("words", ["--bakers theirs", "--errors 1/0", "--errors 2", "--classes soft", "--maps bent"])
def test_a_word_that_means_nothing_is_refused(words: str, models: Path) -> None:
    with pytest.raises(SystemExit):
        chosen_by(words, models)


def test_peers_go_on_where_they_are_to_bracket_and_there_alone(models: Path) -> None:
    for name in PEERS:
        ordinary, bracketed = (a_baker(models, name, Case(scene, BRACKET_SIZE)) for scene in ("bunny", BRACKETED[0]))
        assert ordinary.further == ()
        assert bracketed.settings == ordinary.settings
        assert int(bracketed.further[0]) == 2 * int(bracketed.settings[-1])
        assert bracketed.further[-1] == "4096"
        chosen = chosen_by("", models)
        assert longest(bracketed, "4096", chosen) == BRACKET_SECONDS > longest(bracketed, "1", chosen)
        assert a_baker(models, name, Case(BRACKETED[0], 2 * BRACKET_SIZE)).further == ()
    assert all(a_baker(models, name, Case(BRACKETED[0], BRACKET_SIZE)).further == () for name in OURS)


def test_reflections_are_measured_of_ours(models: Path) -> None:
    assert [each.name for each in bakers_for(Case("spot", 512, "ro_10"), chosen_by("", models))] == [*OURS]


def test_going_on_ends_below_the_error_asked_for_and_where_it_is_of_no_use(models: Path) -> None:
    cycles = a_baker(models, CYCLES, Case("spot", 512), "--errors 1/100")
    assert not _is_at_its_end(cycles, [], 0.0)
    assert not _is_at_its_end(cycles, points(0.08, 0.04, 0.02), 0.0)
    assert _is_at_its_end(cycles, points(0.08, 0.04, 0.02, 0.0099), 0.0)
    assert _is_at_its_end(cycles, points(0.08, 0.04, 0.038), 0.0)


def test_what_a_point_will_take_is_carried_on_along_a_line() -> None:
    assert _expected(4.0, [(1.0, 10.0)]) == 10.0  # tried
    assert _expected(16.0, [(1.0, 100.0), (4.0, 103.0)]) == pytest.approx(115.0)
    assert _expected(64.0, [(1.0, 1.0), (4.0, 4.0), (16.0, 16.0)]) == pytest.approx(64.0)
    assert _expected(64.0, [(4.0, 4.0), (16.0, 3.0)]) == 3.0


def test_points_of_another_state_of_ours_are_not_in_a_check() -> None:
    old, new = (Run(1.0, 0.1, 0.0, 0.0, 1, code=code) for code in ("old", "new"))
    record = Record("spot", 512, points=[Point(OURS_ERROR, "1/255", [old, new]), Point(CYCLES, "1", [old])])
    record.without_other_codes(OURS, "new")
    assert record.of(OURS_ERROR)[0].runs == [new]
    assert record.of(CYCLES)[0].runs == [old]
