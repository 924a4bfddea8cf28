"""``--shard I/N``: the share of a dataset that one of N processes makes, wherever they run, without knowing of each other."""

from __future__ import annotations

import re
from dataclasses import dataclass

from scene_synth_ros.cli.usage import UsageError
from scene_synth_ros.shards.plan import DatasetPlan

_FORM = re.compile(r"([0-9]{1,9})/([0-9]{1,9})")


@dataclass(frozen=True, slots=True)
class Share:
    """Every ``count``-th shard of a dataset, from shard ``index`` on, so that shares end at about the same time.

    Attributes:
        index: of this share, from 0.
        count: how many shares there are; 1 is all.
    """

    index: int = 0
    count: int = 1

    def shards(self, plan: DatasetPlan) -> range:
        """Return the shards of this share."""
        return range(self.index, plan.shards, self.count)

    @property
    def lock(self) -> str:
        """Name of the lock that a process holds which makes this share."""
        return ".lock" if self.count == 1 else f".lock.{self.index}"


def read_share(text: str) -> Share:
    """Return the share that ``I/N`` means.

    Raises:
        UsageError: it is none.
    """
    found = _FORM.fullmatch(text)
    index, count = (int(number) for number in found.groups()) if found else (0, 0)
    if not 0 <= index < count:
        raise UsageError(f"--shard {text}: expected I/N with I from 0 to N - 1: 0/4, 1/4, 2/4 or 3/4, say")
    return Share(index, count)
