"""Maps the log times of a bag to the times at which they are due on a monotonic clock."""

from __future__ import annotations


class Timeline:
    """Log time as it passes, at a rate that may change, with pauses; drift-free because all is counted from one anchor.

    Args:
        rate: log time per clock time, > 0.
        paused: whether log time stands still at first.
    """

    def __init__(self, rate: float, *, paused: bool = False) -> None:
        self._rate = rate
        self._paused = paused
        self._anchor_log_ns = 0
        self._anchor_clock_ns = 0

    @property
    def paused(self) -> bool:
        """Whether log time stands still."""
        return self._paused

    def begin(self, log_ns: int, clock_ns: int) -> None:
        """Let log time be ``log_ns`` at ``clock_ns``."""
        self._anchor_log_ns, self._anchor_clock_ns = log_ns, clock_ns

    def position_ns(self, clock_ns: int) -> int:
        """Return the log time at ``clock_ns``."""
        if self._paused:
            return self._anchor_log_ns
        return self._anchor_log_ns + round((clock_ns - self._anchor_clock_ns) * self._rate)

    def due_ns(self, log_ns: int) -> int | None:
        """Return the clock time of ``log_ns``; None while paused."""
        if self._paused:
            return None
        return self._anchor_clock_ns + round((log_ns - self._anchor_log_ns) / self._rate)

    def set_rate(self, rate: float, clock_ns: int) -> None:
        """Go on at another rate from where log time is."""
        self.begin(self.position_ns(clock_ns), clock_ns)
        self._rate = rate

    def pause(self, clock_ns: int) -> None:
        """Stop log time; once paused, harmless."""
        self.begin(self.position_ns(clock_ns), clock_ns)
        self._paused = True

    def resume(self, clock_ns: int) -> None:
        """Let log time go on; while it runs, harmless."""
        self.begin(self.position_ns(clock_ns), clock_ns)
        self._paused = False
