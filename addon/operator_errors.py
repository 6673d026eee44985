"""What Blender's operators raise: RuntimeError alone, be it a refusal in Blender's words or a traceback of Python's."""

from __future__ import annotations

_TRACEBACK = "Traceback (most recent call last):"
_REPORT = "Error: "


def is_refusal(error: BaseException) -> bool:
    """Whether Blender itself has refused something; no code in Python then is at fault."""
    text = str(error)
    return type(error) is RuntimeError and text.startswith(_REPORT) and _TRACEBACK not in text


def cause_of(error: Exception) -> str:
    """Why, in one line: of a traceback the exception at its end, else what Blender reported first."""
    _, traceback, last = str(error).rpartition(_TRACEBACK)
    lines = [line for line in last.splitlines() if line.strip()]
    if traceback:  # where the exception came from is indented
        lines = [line for line in lines if not line.startswith(" ")]
    return lines[0].strip().removeprefix(_REPORT).rstrip(".") if lines else type(error).__name__
