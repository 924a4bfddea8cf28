"""What is wrong with an evaluation's inputs, and what is told of it beside the scores."""

from collections import Counter

from scene_description import SceneSynthError


class EvaluateError(SceneSynthError):
    """A bag, topic, option or algorithm that cannot be judged; one line: what, where, expected, got, what to do."""


class EstimateError(SceneSynthError):
    """One estimate that cannot be measured: wrong size, encoding or frame; the frame counts as missing.  One line."""


_MOST_LINES = 20


class Notes:
    """Counts of what went wrong.

    Threads: one thread only.

    Attributes:
        missing: task -> frames without an estimate that could be measured.
    """

    def __init__(self) -> None:
        self.missing: Counter[str] = Counter()
        self._missing_frames: set[str] = set()
        self._lines: Counter[str] = Counter()
        self._first: dict[str, str] = {}

    def add_missing(self, task: str, place: str) -> None:
        """Count a frame, which ``place`` tells from all others, as one without an estimate of a task."""
        self.missing[task] += 1
        self._missing_frames.add(place)

    @property
    def missing_frames(self) -> int:
        """How many frames lack an estimate of a task or more."""
        return len(self._missing_frames)

    def add(self, line: str, where: str = "") -> None:
        """Take a line; the same line from several frames is told once, with how often, and where it was first."""
        self._lines[line] += 1
        self._first.setdefault(line, where)

    def take(self, others: "Notes") -> None:
        """Take what was noted of further frames."""
        self.missing.update(others.missing)
        self._missing_frames |= others._missing_frames
        self._lines.update(others._lines)
        self._first = others._first | self._first

    def lines(self) -> list[str]:
        """Return what is to be told, in the order in which it came up."""
        told = []
        for line, count in list(self._lines.items())[:_MOST_LINES]:
            places = [f"first {self._first[line]}" if count > 1 else self._first[line]] if self._first[line] else []
            places += [f"{count} times"] if count > 1 else []
            told.append(f"{line} ({', '.join(places)})" if places else line)
        more = len(self._lines) - _MOST_LINES
        return [*told, f"and {more} more kinds of faults"] if more > 0 else told
