"""An object store that speaks S3, in a process of its own on this machine: moto's server, for tests of URLs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import fsspec

from scene_synth_ros.suite.environment import environment

BUCKET = "rooms"
_SERVE = """
import sys
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
server.start()
print(server.get_host_and_port()[1], flush=True)
sys.stdin.read()
server.stop()
"""
"""Serves until its standard input ends, so that it ends with the process that started it, however that ends."""


@contextmanager
def s3_server() -> Iterator[Mapping[str, str]]:
    """Start a server with the empty bucket ``rooms``; end it afterwards.

    Yields the environment variables that lead any client of S3 there; they are set in this process meanwhile, and its children inherit
    them, so ``s3://rooms/...`` works as it is.
    """
    with subprocess.Popen(
        [sys.executable, "-c", _SERVE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            variables = {
                "AWS_ENDPOINT_URL_S3": f"http://127.0.0.1:{int(process.stdout.readline())}",
                "AWS_ACCESS_KEY_ID": "test",
                "AWS_SECRET_ACCESS_KEY": "test",
                "AWS_DEFAULT_REGION": "us-east-1",
                "AWS_EC2_METADATA_DISABLED": "true",
            }
            with environment(variables):
                forget_clients()
                fsspec.filesystem("s3").mkdir(BUCKET)
                yield variables
        finally:
            process.stdin.close()
            process.wait(timeout=20)
    forget_clients()


def forget_clients() -> None:
    """Let the next client of S3 in this process read the environment anew, and list nothing from memory."""
    fsspec.get_filesystem_class("s3").clear_instance_cache()
