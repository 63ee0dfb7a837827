"""How far a stage is, told to whoever listens; nobody does unless the runner asks."""

from __future__ import annotations

from collections.abc import Callable

Listener = Callable[[int, int], None]
_listeners: list[Listener] = []


def tick(done: int, total: int) -> None:
    """Tell that ``done`` of ``total`` items of the running stage are finished."""
    for listener in _listeners:
        listener(done, total)


def listen(listener: Listener | None) -> None:
    """Make ``listener`` the one that hears of progress in this process; ``None`` ends it."""
    _listeners.clear()
    if listener is not None:
        _listeners.append(listener)
