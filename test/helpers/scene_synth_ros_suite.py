"""Helpers of the tests that run real node processes over DDS."""

from __future__ import annotations

import gc
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from unittest import mock

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Trigger

from scene_description.share import config_path
from scene_synth_ros.cli.processes.supervisor import NODES
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import status_from_json
from scene_synth_ros.suite.transport import PROFILE, PROFILE_VARIABLE, choose_transport

SMALL = ["renderer_node.camera.width:=96", "renderer_node.camera.height:=72", "renderer_node.render.samples_per_pixel:=1"]
SMALL += ["renderer_node.render.auto_exposure:=false"]
"""Overrides that make frames cheap."""


_PROFILE = (PROFILE_VARIABLE, str(config_path(PROFILE)))
"""What a process has in its environment that announces itself as the nodes do."""
_KEPT = 30
"""How many claims of domains are kept until the oldest is let go for a new one."""
_claims: dict[int, socket.socket] = {}
"""Abstract names, which end with this process, of the domains that this process has used last."""
_never_again: set[int] = set()
"""Domains in which nodes of the product lived in this process: parts of them outlive ``destroy_node`` until they are collected."""
_PEERS: dict[Context, list[Peer]] = {}


def claim_domain() -> int:
    """Return a DDS domain that no other test run of this machine uses; it is kept until some later ones have been claimed."""
    while True:
        domain = random.SystemRandom().randint(1, 100)
        claim = socket.socket(socket.AF_UNIX)
        with suppress(OSError):  # held by another run
            claim.bind(f"\0scene_synth_test_domain_{domain}")
            _claims[domain] = claim
            for oldest in [held for held in _claims if held not in _never_again][:-_KEPT]:
                _claims.pop(oldest).close()
            return domain


def environment() -> dict[str, str]:
    """Return the environment of one test run, with a DDS domain of its own."""
    return {**os.environ, "ROS_DOMAIN_ID": str(claim_domain()), "PYTHONPATH": str(Path(__file__).parents[2])}


def announced_often(env: Mapping[str, str]) -> dict[str, str]:
    """Return an environment whose processes announce themselves as often as the nodes do: every 0.1 s for 5 s, then every second.

    Fast DDS announces a participant for half a second, then every 3 s, and may miss the answer to the first announcement of another; who
    starts later may hear of it 3 s later.
    """
    return {**env, _PROFILE[0]: _PROFILE[1]}


def without(package: str, folder: Path) -> dict[str, str]:
    """Return what the environment of a process needs, so that the process cannot import a package that is installed here.

    Args:
        package: its name.
        folder: empty; for what stands in the package's way.
    """
    (folder / f"{package}.py").write_text(f"raise ModuleNotFoundError({package!r}, name={package!r})\n")
    return {"PYTHONPATH": os.pathsep.join([str(folder), str(Path(__file__).parents[2])])}


def command(*words: object) -> list[str]:
    """Return a ``scene_synth`` command line."""
    return [sys.executable, "-m", "scene_synth_ros", *map(str, words)]


def record_command(bag: Path, *words: object) -> list[str]:
    """Return the command line of a run that records small frames."""
    return command("run", "--record", bag, *(word for override in SMALL for word in ("-p", override)), *words)


def run_suite(bag: Path, *words: object, env: dict[str, str] | None = None, timeout_s: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Record a bag with small frames and wait for the end."""
    return subprocess.run(
        record_command(bag, *words),
        env=env or environment(),
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


class Child(subprocess.Popen[str]):
    """A process whose output goes into files: nobody reads while it runs, and a pipe that is full would stop it.

    Args:
        words: the command line.
        options: as of ``subprocess.Popen``.
    """

    def __init__(self, words: Sequence[str], **options: Any) -> None:
        self._files = [tempfile.TemporaryFile("w+", encoding="utf-8") for _ in range(2)]
        super().__init__(words, stdout=self._files[0], stderr=self._files[1], text=True, **options)

    def said(self) -> tuple[str, str]:
        """Return what it has written on stdout and stderr so far."""
        return tuple(os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode() for file in self._files)

    def communicate(self, input: str | None = None, timeout: float | None = None) -> tuple[str, str]:
        """Wait for the end; return what was written on stdout and stderr."""
        self.wait(timeout)
        return self.said()


@contextmanager
def dds_context(domain_id: int) -> Iterator[Context]:
    """Yield a context in a DDS domain; at the end all its nodes are destroyed.

    A participant that is only forgotten lives on with its threads, which takes processor time from every test that comes after, and with
    what it has latched, which a test that gets the same domain would hear.

    Its participants announce themselves as those of the nodes do (:func:`announced_often`).
    """
    context = Context()
    rclpy.init(context=context, domain_id=domain_id)
    with mock.patch.dict(os.environ):  # read when the first participant of the process is made; child processes choose for themselves
        choose_transport()
        Node("first", context=context).destroy_node()
    try:
        yield context
    finally:
        _destroy_nodes(context)
        gc.collect()  # what nodes of this process have made, in circles of references, holds their participant
        rclpy.try_shutdown(context=context)


def _destroy_nodes(context: Context) -> None:
    for peer in _PEERS.pop(context, []):
        peer.destroy()
    nodes = [made for made in gc.get_objects() if issubclass(type(made), Node) and made.context is context]
    if any(type(node) is not Node for node in nodes) and len(_never_again) < _KEPT:
        _never_again.add(context.get_domain_id())
    for node in nodes:
        node.destroy_node()


class Peer:
    """A node of the test's own that talks with a node process; destroyed with its :func:`dds_context`."""

    def __init__(self, context: Context) -> None:
        self.node = Node("test_peer", namespace="/synth", context=context)
        self.errors: list[str] = []
        self.warnings: list[str] = []
        self.values: dict[str, str] = {}
        self._clients: dict[str, Client] = {}
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        _PEERS.setdefault(context, []).append(self)

    def destroy(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self.node.destroy_node()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.errors += [status.message for status in message.status if status.level == DiagnosticStatus.ERROR]
        self.warnings += [status.message for status in message.status if status.level == DiagnosticStatus.WARN]
        self.values |= {item.key: item.value for status in message.status for item in status.values}

    def spin_too(self, node: Node) -> None:
        """Spin a node of this process together with this one."""
        self._executor.add_node(node)

    def spin_until(self, condition: Callable[[], object], timeout_s: float, what: str) -> None:
        """Spin until a condition holds; fail if it does not in time."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, f"waited {timeout_s} s for {what}"
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        """Spin for so long."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.05)

    def meet(self, node: str) -> None:
        """Wait until a node that publishes its status knows every subscription that this peer has made.

        To know its publishers is not enough: it may not have heard of the subscriptions yet.  A participant announces its subscriptions in
        their order, over one reliable channel, so who has answered one made now, with its latched status, knows those before it.
        """
        heard: list[str] = []
        last = self.node.create_subscription(String, "status", lambda message: heard.append(message.data), latched_qos(100))
        name = f"{self.node.get_namespace()}/{node}"
        self.spin_until(lambda: any(status_from_json(text).node == name for text in heard), 120, f"the status of {name}")
        self.node.destroy_subscription(last)

    def find(self, kind: type, name: str) -> Client:
        """Return the client of a service that is there; a call in a moment that is soon over needs one found before."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        self.spin_until(self._clients[name].service_is_ready, 120, name)
        return self._clients[name]

    def call(self, kind: type, name: str, request: Any) -> Any:
        """Call a service and return its answer."""
        future = self.find(kind, name).call_async(request)
        self.spin_until(future.done, 120, f"the answer of {name}")
        return future.result()

    def trigger(self, name: str) -> tuple[bool, str]:
        """Call a std_srvs/Trigger; return whether it was done and what it says."""
        answer = self.call(Trigger, name, Trigger.Request())
        return answer.success, answer.message

    def set_parameter(self, node: str, name: str, value: object) -> tuple[bool, str]:
        """Set a parameter of another node; return whether it was taken and, if not, why."""
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        (result,) = self.call(SetParameters, f"{node}/set_parameters", request).results
        return result.successful, result.reason


@contextmanager
def node_process(
    name: str, settings: Mapping[str, object], surroundings: Mapping[str, str] | None = None, files: Sequence[Path] = ()
) -> Iterator[Context]:
    """Run a node in a process and a DDS domain of its own; yield a context in that domain.  The node must outlive the block.

    Args:
        name: of the node.
        settings: its parameters.
        surroundings: variables of its environment besides.
        files: its parameter files.
    """
    env = environment() | dict(surroundings or {})
    words = [sys.executable, "-m", NODES[name].module, "--ros-args", "-r", "__ns:=/synth"]
    words += [word for file in files for word in ("--params-file", str(file))]
    words += [word for key, value in settings.items() for word in ("-p", f"{key}:={value}")]
    process = Child(words, env=env)
    try:
        with dds_context(int(env["ROS_DOMAIN_ID"])) as context:
            yield context
            assert process.poll() is None, f"{name} must have survived everything: {process.said()}"
            assert "fault of the program" not in process.said()[1], process.said()[1]
    finally:
        stop(process)
        sys.stderr.write("\n".join(process.said()))  # shown when the test fails


def wait_until(condition: Callable[[], object], timeout_s: float, what: str, child: Child | None = None) -> None:
    """Wait until a condition holds.

    Raises:
        TimeoutError: it does not in time; with what the child has said.
    """
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            said = "\n".join(text[-3000:] for text in child.said()) if child else ""
            raise TimeoutError(f"waited {timeout_s} s for {what}\n{said}")
        time.sleep(0.05)


def marked_processes(marker: str) -> list[Path]:
    """Return the folders below ``/proc`` of the processes whose environment holds ``marker``."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if marker.encode() in (process / "environ").read_bytes():
                found.append(process)
    return found


def node_pids(marker: str) -> dict[str, int]:
    """Return node name -> process id of the running nodes whose environment holds ``marker``."""
    found = {}
    for process in marked_processes(marker):
        try:
            words = (process / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        modules = [word for word in words if word.startswith("scene_synth_ros.")]
        programs = [Path(word).name for word in words if Path(word).parent.name == "scene_synth_ros"]  # of an installed copy
        name = next((word.rsplit(".", 1)[-1] for word in (*modules, *programs)), "")
        if name:
            found[name] = int(process.name)
    return found


def stop(process: subprocess.Popen[str]) -> None:
    """End a process that a test has started, whatever has become of the test."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
    process.communicate()
