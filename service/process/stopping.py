"""A request to stop, which signal handlers may make."""

from __future__ import annotations

from queue import Empty, SimpleQueue


class StopRequest:
    """A switch that is set once; safe in a signal handler, unlike ``threading.Event``.

    A signal may arrive while its thread holds an event's lock; setting the event in the handler
    would then wait for ever. Putting into a ``SimpleQueue`` never does.
    """

    def __init__(self) -> None:
        self._asked: SimpleQueue[None] = SimpleQueue()

    def ask(self) -> None:
        """Set the switch."""
        self._asked.put(None)

    def is_asked(self) -> bool:
        """Return whether it has been set."""
        return not self._asked.empty()

    def wait(self, time_s: float) -> bool:
        """Wait until it is set, but at most this long; return whether it has been."""
        try:
            self._asked.get(timeout=time_s)
        except Empty:
            return False
        self._asked.put(None)
        return True
