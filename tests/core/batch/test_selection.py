"""Which items are meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.batch.selection import chosen_items, told_items


def test_numbers_and_ranges() -> None:
    assert chosen_items("0-2,7, 5", 8) == [0, 1, 2, 7, 5]
    assert chosen_items("3,3,2-4", 8) == [3, 2, 4]  # none twice


@given(st.integers(0, 200), st.integers(1, 40))
def test_shares_are_all_items_once_and_about_equal(count: int, shares: int) -> None:
    parts = [chosen_items(f"{number}/{shares}", count) for number in range(1, shares + 1)]
    assert [item for part in parts for item in part] == list(range(count))
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@given(st.sets(st.integers(0, 60), min_size=1))
def test_what_is_told_is_what_was_meant(numbers: set[int]) -> None:
    assert chosen_items(told_items(sorted(numbers)), 61) == sorted(numbers)


@pytest.mark.parametrize("text", ["8", "0-8", "5-3", "-1", "", "a", "1.5", "0/3", "4/3", "1/0", "1-"])
def test_what_no_item_is_meant_by(text: str) -> None:
    with pytest.raises(InputError, match="--items"):
        chosen_items(text, 8)


def test_of_no_items() -> None:
    assert chosen_items("1/3", 0) == []
    with pytest.raises(InputError, match="0 items, none"):
        chosen_items("0", 0)
