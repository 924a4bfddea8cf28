"""How a node's process starts and ends: one line for bad input, no traceback, quick and orderly ends on signals."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from scene_synth_ros.suite.heap import limit_arenas
from scene_synth_ros.suite.stale_shared_memory import avoid_stale_ports
from scene_synth_ros.suite.suite_node import REFUSALS

T = TypeVar("T")
SETTLE_S, QUIET_S = 1.0, 0.1
"""How long a node that a signal ends goes on taking messages at most, and what it takes for the end of them."""


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> None:
    """Spin a node until it sets its ``exit_code`` or a signal comes, then end the process.

    The node has ``exit_code``, None while it runs, and ``close()``, which frees what it holds and is called once, after spinning has ended.
    If it has ``arrivals``, a count of messages, it gets those that are on their way to it when the signal comes.

    SIGINT and SIGTERM are the ordinary end of a node: code 0 after ``close``.  One of ``REFUSALS`` while the node is made (a refused
    parameter, a folder that exists) ends it with code 2 and one line on stderr.
    """
    caught: list[int] = []
    limit_arenas()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _frame: caught.append(got))
    node, refusal = _make(make)
    if node is None:
        sys.stderr.write(f"{refusal}\n")
        rclpy.try_shutdown()
        end_process(2)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not caught and node.exit_code is None:
            executor.spin_once(timeout_sec=0.1)
        if node.exit_code is None and hasattr(node, "arrivals"):
            _take_what_comes(executor, node)
    except ExternalShutdownException:
        caught.append(signal.SIGTERM)
    except Exception:  # a fault of the program: say all of it, and still close what the node holds
        node.get_logger().fatal(traceback.format_exc())
        node.exit_code = 1
    node.close()
    code = node.exit_code or 0
    executor.shutdown(timeout_sec=0.5)
    node.destroy_node()
    rclpy.try_shutdown()
    end_process(code)


def _make(make: Callable[[], Node]) -> tuple[Node | None, str]:
    """Return the node, or None and why it cannot be; the half-made node is freed, and with it its shared memory."""
    try:
        with avoid_stale_ports():
            return make(), ""
    except REFUSALS as error:
        return None, " ".join(str(error).split())


def _take_what_comes(executor: SingleThreadedExecutor, node: Any) -> None:
    """Spin on until nothing more arrives, so that what DDS holds for the node is not lost."""
    end, before = time.monotonic() + SETTLE_S, -1
    while time.monotonic() < end and node.arrivals != before:
        before, quiet = node.arrivals, time.monotonic() + QUIET_S
        while time.monotonic() < quiet:
            executor.spin_once(timeout_sec=0.01)


def end_process(code: int) -> None:
    """End the process now; a worker thread deep in a kernel or a compilation must not hold it up."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


class Worker:
    """One daemon thread that runs jobs off the executor, in order; results come back as futures."""

    def __init__(self, name: str) -> None:
        self._jobs: list[tuple[Callable[[], object], Future[object]]] = []
        self._wake = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, job: Callable[[], T]) -> Future[T]:
        """Queue a job and return its future."""
        future: Future[T] = Future()
        with self._wake:
            self._jobs.append((job, future))  # type: ignore[arg-type]
            self._wake.notify()
        return future

    def close(self) -> None:
        """End the thread after the job at work; what is queued is dropped."""
        with self._wake:
            self._closed = True
            self._wake.notify()

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._closed or bool(self._jobs))
                if self._closed:
                    return
                job, future = self._jobs.pop(0)
            try:
                future.set_result(job())
            except Exception as error:  # handed to whoever asks for the result
                future.set_exception(error)
