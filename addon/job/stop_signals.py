"""The signals that ask a program to stop, of the user, the system, or a farm's scheduler."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

CTRL_C = (signal.SIGINT,)
STOPPING = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if name in signal.Signals.__members__
)


@contextmanager
def handled(signals: Sequence[signal.Signals], handler: Callable[..., Any]) -> Iterator[None]:
    """These signals call `handler` for the time; outside the main thread nothing changes, as Python has it. Those that
    the program was told to ignore, as by nohup, stay ignored, but for Ctrl-C."""
    before = {}
    with suppress(ValueError):
        for each in signals:
            if each == signal.SIGINT or signal.getsignal(each) is not signal.SIG_IGN:
                before[each] = signal.signal(each, handler)
    try:
        yield
    finally:
        for each, last in before.items():
            signal.signal(each, signal.SIG_DFL if last is None else last)


@contextmanager
def interrupted_by(signals: Sequence[signal.Signals], *, at_once: bool = True) -> Iterator[None]:
    """These signals raise KeyboardInterrupt: at once, and again at the end, since C code in between may swallow it; or
    at the end alone, for what does not bear it, as imports of modules in C."""
    heard = False

    def hear(*_: Any) -> None:
        nonlocal heard
        heard = True
        if at_once:
            raise KeyboardInterrupt

    try:
        with handled(signals, hear):
            yield
    except Exception:
        if heard:  # it may come of that
            raise KeyboardInterrupt from None
        raise
    if heard:
        raise KeyboardInterrupt
