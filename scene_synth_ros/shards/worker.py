"""A worker: makes shard after shard of a dataset on its own processors.  ``python -m scene_synth_ros.shards.worker`` with lines of JSON.

On stdin come ``{"processors", "plan", "where"}`` once, then ``{"shard", "given_up"}`` for each shard; the end of stdin ends the worker at
once, even at work, so that none outlives a run that was killed.  On stdout go ``{"what", "room", "error"}`` as a shard proceeds,
``{"what": "done", "shard"}``, or ``{"what": "broken", "error"}`` where it could not be made, after which the worker ends.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any

from scene_synth_ros.shards.worker_start import pin


def main() -> int:
    """Work until stdin ends; return the exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the first process's, which ends stdin
    orders: queue.Queue[dict[str, Any]] = queue.Queue()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no answer

    def tell(what: str, **values: object) -> None:
        answers.write(json.dumps({"what": what, **values}) + "\n")
        answers.flush()

    begin = json.loads(sys.stdin.readline() or "null")
    if begin is None:
        return 0
    pin(begin["processors"])

    def listen() -> None:
        for line in sys.stdin:
            orders.put(json.loads(line))
        os._exit(0)  # nobody is there any more who could want a shard

    threading.Thread(target=listen, name="orders", daemon=True).start()
    return work(begin["plan"], begin["where"], orders.get, tell)


def work(plan_text: str, where: str, next_order: Callable[[], dict[str, Any]], tell: Callable[..., None]) -> int:
    """Make the shards that are asked for, without end; return 1 when one could not be made.

    Args:
        plan_text: ``dataset.json``.
        where: folder or URL of the dataset.
        next_order: waits for the next shard: its number, and the rooms that are not tried any more.
        tell: says what is done: called with ``what``, and its values by name.
    """
    from scene_description import SceneSynthError, error_line  # numba, Embree and BLAS load now, on the worker's processors
    from scene_synth_ros.bags.dataset_files import PLAN_NAME
    from scene_synth_ros.shards.make_shard import Progress, make_shard
    from scene_synth_ros.shards.open_store import open_store
    from scene_synth_ros.shards.plan import read_plan
    from scene_synth_ros.suite.heap import collect_rarely, limit_arenas

    limit_arenas()
    collect_rarely()
    plan, store = read_plan(plan_text.encode(), PLAN_NAME), open_store(where)

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


if __name__ == "__main__":
    sys.exit(main())
