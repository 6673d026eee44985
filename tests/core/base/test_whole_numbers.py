"""Whole numbers say how wide they are: numpy 1 makes them 32 bits wide on Windows, where nothing else says it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[3]
SOURCES = [
    path for room in ("core", "addon") for path in sorted((PACKAGE / room).rglob("*.py")) if "kernel" not in path.parts
]


def widthless(source: str) -> Iterator[int]:
    """The lines that make whole numbers by numpy's own choice of width."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute) or _says_width(node):
            continue
        name, numbers = node.func.attr, [each for each in ast.walk(node) if isinstance(each, ast.Constant)]
        fractions = any(isinstance(each.value, float) for each in numbers)
        filled = len(node.args) == 2 and isinstance(_unsigned(node.args[1]), int)
        if ast.unparse(node.func.value) == "np" and (
            (name in ("arange", "indices") and not fractions) or (name == "full" and filled)
        ):
            yield node.lineno


def _says_width(call: ast.Call) -> bool:
    return any(each.arg == "dtype" for each in call.keywords) or len(call.args) > 2


def _unsigned(node: ast.expr) -> object:
    inner = node.operand if isinstance(node, ast.UnaryOp) else node
    return inner.value if isinstance(inner, ast.Constant) and not isinstance(inner.value, bool) else None


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("np.arange(n)", [1]),
        ("np.arange(n, dtype=np.int64)", []),
        ("np.arange(n + 1.0)", []),
        ("np.full(n, -1)", [1]),
        ("np.full(n, -1, np.int64)", []),
        ("np.full(n, np.inf)", []),
        ("np.full(n, True)", []),
        ("np.indices((2, 2))", [1]),
    ],
)
def test_a_missing_width_is_seen(line: str, found: list[int]) -> None:
    assert list(widthless(line)) == found


def test_all_whole_numbers_say_their_width() -> None:
    assert len(SOURCES) > 100
    missing = [f"{path.relative_to(PACKAGE)}:{line}" for path in SOURCES for line in widthless(path.read_text("utf-8"))]
    assert not missing
