"""Tables as Markdown writes them."""

from collections.abc import Iterable, Sequence


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """The lines of a table: a head, the line below it, and the rows."""
    return [row(columns), f"|{'---|' * len(columns)}", *map(row, rows)]


def row(cells: Sequence[object]) -> str:
    """One line of it."""
    return f"| {' | '.join(map(str, cells))} |"
