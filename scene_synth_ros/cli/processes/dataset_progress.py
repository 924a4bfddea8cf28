"""How far a dataset has come: a line on a terminal, plain lines elsewhere; rate and time left are of this run."""

import sys
from collections.abc import Mapping, Sequence
from time import monotonic
from types import TracebackType
from typing import Any

from tqdm import tqdm

from scene_synth_ros.shards.plan import DatasetPlan

_FORM = "{desc} {bar:20} {n_fmt} of {total_fmt} frames, {rate_fmt}, {remaining} left"
_PLAIN_EVERY_S = 10.0


class DatasetProgress:
    """Counts the frames of rooms as workers tell of them; a room that begins again is counted anew.  A context manager.

    ``shards``: that this run is to complete, all or those of a share.
    ``missing``: those of them that are made in this run.
    """

    def __init__(self, plan: DatasetPlan, shards: Sequence[int], missing: Sequence[int]) -> None:
        self._plan, self._shards_done, self._shards = plan, len(shards) - len(missing), len(shards)
        self._began = self._plain_s = monotonic()
        self._of_rooms: dict[int, int] = {}
        self._total, left = (plan.frames * sum(len(plan.rooms_of(shard)) for shard in some) for some in (shards, missing))
        self._first = self._frames = self._total - left
        self._bar = tqdm(
            total=self._total,
            initial=self._first,
            bar_format=_FORM,
            dynamic_ncols=True,
            disable=None,
            leave=False,
            unit=" frames",
            smoothing=0.05,
            file=sys.stderr,
        )

    def take(self, event: Mapping[str, Any]) -> None:
        """Take what a worker says."""
        what = event["what"]
        if what == "room":
            self._frames -= self._of_rooms.pop(event["room"], 0)
        elif what == "frame":
            self._of_rooms[event["room"]] = self._of_rooms.get(event["room"], 0) + 1
            self._frames += 1
        elif what == "failed":
            self._say(f"room {event['room']} failed: {event['error']}")
        elif what == "done":
            self._shards_done += 1
            for room in self._plan.rooms_of(event["shard"]):
                self._frames += self._plan.frames - self._of_rooms.pop(room, 0)
        self._show(what == "done" and self._shards_done == self._shards)

    def _show(self, last: bool) -> None:
        if not self._bar.disable:
            self._bar.set_description_str(f"shard {self._shards_done} of {self._shards}", refresh=False)
            self._bar.update(self._frames - self._bar.n)
        elif last or monotonic() - self._plain_s > _PLAIN_EVERY_S:
            self._plain_s = monotonic()
            self._say(self.line(self._plain_s - self._began))

    def line(self, seconds: float) -> str:
        """Return where the dataset is after so long a time of this run."""
        rate = (self._frames - self._first) / max(seconds, 1e-9)
        left = f"{tqdm.format_interval((self._total - self._frames) / rate)} left" if rate else "no frame yet"
        return f"shard {self._shards_done} of {self._shards}: {self._frames} of {self._total} frames, {rate:.2f} frames/s, {left}"

    def _say(self, text: str) -> None:
        self._bar.write(text, file=sys.stderr)
        sys.stderr.flush()

    def __enter__(self) -> "DatasetProgress":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.close()
