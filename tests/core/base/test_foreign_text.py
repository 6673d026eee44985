"""Text that others have written."""

from __future__ import annotations

import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.base.foreign_text import check_utf8, json_object


@pytest.mark.parametrize(
    "text", [None, 7, b"{}", "", "{", "[1]", "null", "[" * 100_000, '{"a":' * 100_000, "1" * 10_000, "\ud800"]
)
def test_what_is_no_json_object_is_an_empty_one(text: object) -> None:
    assert json_object(text) == {}


def test_an_object() -> None:
    assert json_object('{"a": [1, null]}') == {"a": [1, None]}


def test_a_byte_that_is_no_text_is_shown_as_it_stands() -> None:
    with pytest.raises(InputError) as refused:
        check_utf8(b"caf\xe9".decode(errors="surrogateescape"))
    assert str(refused.value).startswith(r"caf\udce9: ") and str(refused.value).encode()
    check_utf8("café 茶")
