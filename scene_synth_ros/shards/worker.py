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
    from scene_synth_ros.shards.worker_job import work  # numba, Embree and BLAS load now, on the worker's processors

    return work(begin["plan"], begin["where"], orders.get, tell)


if __name__ == "__main__":
    sys.exit(main())
