"""How a node's process starts and ends: one line for bad input, quick and orderly ends on signals, a status of its own for faults."""

import itertools
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from scene_description import error_line
from scene_synth_ros.suite.environment import SUPERVISED
from scene_synth_ros.suite.faults import FAULT_STATUS, fault_report
from scene_synth_ros.suite.heap import collect_rarely, limit_arenas
from scene_synth_ros.suite.parameters import ParameterError
from scene_synth_ros.suite.stale_shared_memory import avoid_stale_ports
from scene_synth_ros.suite.suite_node import REFUSALS
from scene_synth_ros.suite.transport import choose_transport

_SOURCE_PLACES = re.compile(r", at \S+:\d+")
"""Where in its sources rcl has found an error, which it appends to what it says."""
SETTLE_S, QUIET_S = 1.0, 0.3
"""How long a node that a signal ends goes on taking messages at most, and what it takes for the end of them."""

_LISTEN_S = 0.2
"""How long a node without any work may take to notice a signal."""


def init_ros(args: list[str] | None = None) -> None:
    """Initialise rclpy with the transport that the nodes need, leaving signals to the caller; the one door to ROS of every process."""
    own_transport = choose_transport()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    if own_transport:
        get_logger("scene_synth_ros").info(own_transport)


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> None:
    """Spin a node until it sets its ``exit_code`` or a signal comes, then end the process.

    The node has ``exit_code``, None while it runs, and ``close()``, which frees what it holds and is called once, after spinning has ended.
    If it has ``arrivals``, a count of messages, it gets those that are on their way to it when the signal comes.

    SIGINT and SIGTERM are the ordinary end of a node: code 0 after ``close``, and ``leave``, where it has that, tells the peers.  Whoever
    watches a node of ``scene_synth run`` sees it ended by the signal itself, after ``close``.  One of ``REFUSALS`` while the node is made
    (a refused parameter, a folder that exists) ends it with code 2 and one line on stderr; a fault of the program with ``FAULT_STATUS``
    and its traceback.  Threads that still work end with the process.  A launch that ends, ends its nodes.
    """
    code = FAULT_STATUS
    try:
        code = _run(make, args)
    except KeyboardInterrupt:
        code = 130
    except Exception as error:
        sys.stderr.write(f"{fault_report(error, 'a node started or ended')}\n")
    finally:
        end_process(code)


def _run(make: Callable[[], Node], args: list[str] | None) -> int:
    """Make the node, spin it and close it; return the exit status."""
    caught: list[int] = []
    collect_rarely()
    limit_arenas()
    node, refusal = _make(make, args, caught)
    if node is None:
        sys.stderr.write(f"{refusal}\n")
        rclpy.try_shutdown()
        return 2
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not caught and node.exit_code is None:
            executor.spin_once(timeout_sec=_LISTEN_S)
        if node.exit_code is None:
            _take_leave(executor, node, caught[0])
    except ExternalShutdownException:
        caught.append(signal.SIGTERM)
    except Exception as error:
        node.get_logger().fatal(fault_report(error, f"{node.get_name()} worked"))
        node.exit_code = FAULT_STATUS
    close_node(node)
    executor.shutdown(timeout_sec=0.5)
    node.destroy_node()
    rclpy.try_shutdown()
    return node.exit_code or end_status(caught)


def end_status(caught: Sequence[int]) -> int:
    """Return what a process that has done its work ends with: 0, or a signal's number below 0 for who watches the nodes of a run."""
    return -caught[0] if caught and SUPERVISED in os.environ else 0


def _make(make: Callable[[], Node], args: list[str] | None, caught: list[int]) -> tuple[Node | None, str]:
    """Return the node, or None and why it cannot be; the half-made node is freed, and with it its shared memory."""
    try:
        _refuse_missing_files(sys.argv if args is None else args)
        init_ros(args)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda got, _frame: caught.append(got))
        with avoid_stale_ports():
            return make(), ""
    except REFUSALS as error:
        return None, _SOURCE_PLACES.sub("", error_line(error))


def _refuse_missing_files(words: Sequence[str]) -> None:
    """Refuse parameter files that are not there, before rcl does so in its own words.

    Raises:
        ParameterError: one is no file.
    """
    for word, path in itertools.pairwise(words):
        if word == "--params-file" and not Path(path).is_file():
            raise ParameterError(f"--params-file {path}: expected a parameter file, got none; check the path, or take it away for defaults")


def close_node(node: Any) -> None:
    """Let a node free what it holds; a fault on the way is logged and becomes its exit code."""
    try:
        node.close()
    except Exception as error:
        node.get_logger().fatal(fault_report(error, f"{node.get_name()} was closed"))
        node.exit_code = FAULT_STATUS


def _take_leave(executor: SingleThreadedExecutor, node: Any, number: int) -> None:
    """Let a node say that a signal ends it, and spin on until nothing more arrives, so that what DDS holds for it is not lost."""
    if hasattr(node, "leave"):
        node.leave("" if SUPERVISED in os.environ else f"ended by {signal.Signals(number).name}")
    end, before = time.monotonic() + SETTLE_S, -1
    while hasattr(node, "arrivals") and time.monotonic() < end and node.arrivals != before:
        before, quiet = node.arrivals, time.monotonic() + QUIET_S
        while time.monotonic() < quiet:
            executor.spin_once(timeout_sec=0.01)


def end_process(code: int) -> None:
    """End the process now, below 0 by a signal; a worker thread deep in a kernel or a compilation must not hold it up."""
    sys.stdout.flush()
    sys.stderr.flush()
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)
