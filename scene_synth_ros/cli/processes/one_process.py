"""All nodes of a run in one process: ``python -m scene_synth_ros.cli.processes.one_process --namespace NS NODE=PARAMETERS.yaml ...``

Images then go from renderer to recorder without leaving the process; a fault of one node ends all.
"""

import argparse
import importlib
import signal
import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from scene_description import error_line
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.processes.supervisor import NODES
from scene_synth_ros.suite.faults import FAULT_STATUS, fault_report
from scene_synth_ros.suite.heap import limit_arenas
from scene_synth_ros.suite.process import close_node, end_process, end_status, init_ros
from scene_synth_ros.suite.stale_shared_memory import avoid_stale_ports
from scene_synth_ros.suite.suite_node import REFUSALS, SuiteNode

SETTLE_S = 0.5
"""How long the recorder may still receive once the others are closed."""


def make_node(name: str, parameters: str, namespace: str) -> SuiteNode:
    """Return a node of the suite; further renderers are called ``renderer_node_...``.

    Raises:
        OSError, SceneSynthError: its parameters do not fit; one line.
    """
    known = NODES.get("renderer_node" if name.startswith("renderer_node") else name)
    if known is None:
        raise UsageError(f"one_process: unknown node '{name}'; known: {', '.join(NODES)}")
    kind = getattr(importlib.import_module(known.module), known.node_class)
    words = ["--ros-args", "-r", f"__node:={name}", "-r", f"__ns:={namespace}", "--params-file", parameters]
    node: SuiteNode = kind(cli_args=words, use_global_arguments=False)
    return node


def run(names: dict[str, str], namespace: str) -> int:
    """Spin all nodes, name -> parameter file, until each has ended or one has failed; return the exit status."""
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _frame: caught.append(got))
    nodes: list[SuiteNode] = []
    executor = SingleThreadedExecutor()
    code = 0
    try:
        with avoid_stale_ports():
            for name, parameters in names.items():
                nodes.append(make_node(name, parameters, namespace))
                executor.add_node(nodes[-1])
        while not caught and any(node.exit_code is None for node in nodes) and not any(node.exit_code for node in nodes):
            executor.spin_once(timeout_sec=0.1)
    except ExternalShutdownException:
        pass
    except REFUSALS as error:
        sys.stderr.write(f"{error_line(error)}\n")
        code = 2
    except Exception as error:  # say all of it, and still close the bag
        sys.stderr.write(f"{fault_report(error, 'the nodes of one process worked')}\n")
        code = FAULT_STATUS
    recorders = [node for node in nodes if node.get_name() == "recorder_node"]
    for node in nodes:
        if node not in recorders:
            executor.remove_node(node)
            close_node(node)
    settled = time.monotonic() + SETTLE_S
    while recorders and not code and time.monotonic() < settled:
        executor.spin_once(timeout_sec=0.05)
    for node in recorders:
        close_node(node)
    return code or max((node.exit_code or 0 for node in nodes), default=0) or end_status(caught)


def main(args: list[str] | None = None) -> None:
    """Run nodes in this process."""
    parser = argparse.ArgumentParser(prog="one_process", description="Run nodes of the suite in one process.")
    parser.add_argument("--namespace", default="/synth", help="namespace of nodes and topics (default: %(default)s)")
    parser.add_argument("--log-level", default="info", help="(default: %(default)s)")
    parser.add_argument("nodes", nargs="+", metavar="NODE=PARAMETERS.yaml", help="nodes in the order in which they are made")
    parsed = parser.parse_args(args)
    limit_arenas()
    code = FAULT_STATUS
    try:
        init_ros(["--ros-args", "--log-level", parsed.log_level])
        names = dict(word.split("=", 1) for word in parsed.nodes if "=" in word)
        code = run(names, parsed.namespace)
        rclpy.try_shutdown()
    except Exception as error:
        sys.stderr.write(f"{fault_report(error, 'the nodes of one process started or ended')}\n")
    finally:
        end_process(code)


if __name__ == "__main__":
    main()
