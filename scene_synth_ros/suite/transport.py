"""Which transport the nodes speak over: large images need more shared memory than Fast DDS has by default.

Publishers decide: an image lies in the shared memory of the process that sends it.  With the default segment of half a megabyte a 640x480
image does not fit, is sent again when the subscriber complains, and is overwritten in the publisher's history before it has arrived.

Everything that makes a node goes through :func:`~scene_synth_ros.suite.process.init_ros`, which calls this first.
"""

import os
from collections.abc import MutableMapping
from pathlib import Path

from rclpy.utilities import get_rmw_implementation_identifier

from scene_description.share import config_path

PROFILE = "fastdds_large_images.xml"
PROFILE_VARIABLE, TRANSPORTS_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS"
LOCAL_PROFILE, SKIP_VARIABLE = "DEFAULT_FASTRTPS_PROFILES.xml", "SKIP_DEFAULT_XML_FILE"
"""Where Fast DDS 2.14, that of ROS 2 Jazzy, takes a transport from: a file by the first variable, a choice by the second, and the file of
that name in the working directory unless the last variable is 1."""


def choose_transport(environment: MutableMapping[str, str] = os.environ) -> str:
    """Let Fast DDS load the shipped profile, unless the user has chosen; to be called before ``rclpy.init``.

    Args:
        environment: of this process; changed.

    Returns:
        What there is to say of the user's own choice, in one line; empty if there is none, or if the middleware is not Fast DDS.
    """
    if "fastrtps" not in get_rmw_implementation_identifier():
        return ""
    shipped = str(config_path(PROFILE))
    own = _own_choice(environment)
    if not own:
        environment[PROFILE_VARIABLE] = shipped
    if not own or environment.get(PROFILE_VARIABLE) == shipped:
        return ""
    return f"the transport is your own, {own}; large images may be lost where it has less shared memory than {shipped}"


def _own_choice(environment: MutableMapping[str, str]) -> str:
    """Return what the user has chosen, empty if nothing."""
    for variable in (PROFILE_VARIABLE, TRANSPORTS_VARIABLE):
        if environment.get(variable):
            return f"{variable}={environment[variable]}"
    if environment.get(SKIP_VARIABLE) != "1" and Path(LOCAL_PROFILE).exists():
        return str(Path(LOCAL_PROFILE).absolute())
    return ""
