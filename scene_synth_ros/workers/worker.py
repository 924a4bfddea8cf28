"""A worker: does task after task on its own processors.  ``python -m scene_synth_ros.workers.worker DESCRIPTOR``, of a connection.

It gets its processors and what to do (:class:`scene_synth_ros.workers.pool.WorkerPool`), then tasks; it sends ``("told", value)`` as a task
proceeds, ``("done", result)``, or ``("failed", line)``, after which it ends.  Where the other side of the connection ends, so does the
worker, even at work, so that none outlives a run that was killed; its temporary folders go with it.
"""

import contextlib
import importlib
import os
import pickle
import queue
import sys
import threading
import traceback
from multiprocessing.connection import Connection

from scene_synth_ros.workers.processors import pin
from scene_synth_ros.workers.temporary_folder import remove_own_folders


def main() -> int:
    """Work until the connection ends; return 1 when a task could not be done."""
    connection: Connection = Connection(int(sys.argv[1]))
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    try:
        processors, module, name, setup = connection.recv()
    except EOFError:
        return 0
    pin(processors)

    def listen() -> None:
        try:
            while True:
                tasks.put(connection.recv_bytes())
        except (EOFError, OSError):  # nobody is there any more who could want a result
            remove_own_folders()
            os._exit(0)

    threading.Thread(target=listen, name="tasks", daemon=True).start()
    return _work(connection, tasks, module, name, setup)


def _work(connection: Connection, tasks: queue.SimpleQueue[bytes], module: str, name: str, setup: bytes) -> int:
    from scene_description import SceneSynthError, error_line  # numba, Embree and BLAS load now, on the worker's processors
    from scene_synth_ros.suite.heap import collect_rarely, limit_arenas

    limit_arenas()
    collect_rarely()
    try:
        do = getattr(importlib.import_module(module), name)(pickle.loads(setup))
        while True:
            connection.send(("done", do(pickle.loads(tasks.get()), lambda value: connection.send(("told", value)))))
    except (SceneSynthError, OSError) as error:
        line = error_line(error)
    except MemoryError:
        line = "the memory does not suffice; take fewer --workers"
    except Exception as error:
        traceback.print_exc()
        line = f"fault of the program: {type(error).__name__}: {error_line(error)}"
    with contextlib.suppress(BrokenPipeError):
        connection.send(("failed", line))
    return 1


if __name__ == "__main__":
    sys.exit(main())
