"""Jobs in daemon threads: results and whatever is raised arrive, jobs follow each other, and no process waits for one at its end."""

import subprocess
import sys
import threading
from concurrent.futures import CancelledError

import pytest

from scene_synth_ros.suite.daemon_job import start_daemon_job


def test_the_result_arrives() -> None:
    assert start_daemon_job("seven", lambda: 7).result(10) == 7


@pytest.mark.parametrize("error", [ValueError("wrong"), SystemExit(3)])
def test_whatever_is_raised_arrives(error: BaseException) -> None:
    def fail() -> None:
        raise error

    assert start_daemon_job("fail", fail).exception(10) is error


def test_a_job_begins_when_the_one_before_has_ended_and_a_cancelled_one_never() -> None:
    gate, order = threading.Event(), []
    first = start_daemon_job("first", lambda: (gate.wait(10), order.append("first")))
    second = start_daemon_job("second", lambda: order.append("second"), after=first)
    third = start_daemon_job("third", lambda: order.append("third"), after=second)
    assert second.cancel() and not first.cancel()
    assert not third.done()
    gate.set()
    third.result(10)
    assert order == ["first", "third"]
    with pytest.raises(CancelledError):
        second.result(10)


ENDLESS = """
import threading
from scene_synth_ros.suite.daemon_job import start_daemon_job
start_daemon_job("endless", threading.Event().wait)
"""


def test_a_process_does_not_wait_for_a_job_at_its_end() -> None:
    assert subprocess.run([sys.executable, "-c", ENDLESS], timeout=300, check=False).returncode == 0
