"""What a worker does once it is on its processors."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any, Protocol

from scene_description import SceneSynthError, error_line
from scene_synth_ros.shards.make_shard import Progress, make_shard
from scene_synth_ros.shards.open_store import open_store
from scene_synth_ros.shards.plan import read_plan
from scene_synth_ros.suite.heap import collect_rarely, limit_arenas


class Tell(Protocol):
    """Says something to whoever has started the worker."""

    def __call__(self, what: str, **values: object) -> None:
        """Say what has happened, with its values."""


def work(plan_text: str, where: str, next_order: Callable[[], dict[str, Any]], tell: Tell) -> int:
    """Make the shards that are asked for, without end; return 1 when one could not be made.

    Args:
        plan_text: ``dataset.json``.
        where: folder or URL of the dataset.
        next_order: waits for the next shard: its number, and the rooms that are not tried any more.
        tell: says what is done.
    """
    limit_arenas()
    collect_rarely()
    plan, store = read_plan(plan_text.encode(), "dataset.json"), open_store(where)

    def tell_progress(progress: Progress) -> None:
        tell(progress.what, room=progress.room, error=progress.error)

    while True:
        order = next_order()
        given_up = {int(index): str(error) for index, error in order["given_up"].items()}
        try:
            make_shard(plan, order["shard"], store, tell_progress, given_up)
        except (SceneSynthError, OSError) as error:
            tell("broken", error=error_line(error))
            return 1
        except MemoryError:
            tell("broken", error=f"shard {order['shard']}: the memory does not suffice; take fewer --workers")
            return 1
        except Exception as error:
            traceback.print_exc()
            tell("broken", error=f"fault of the program at shard {order['shard']}: {type(error).__name__}: {error_line(error)}")
            return 1
        tell("done", shard=order["shard"])
