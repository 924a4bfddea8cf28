"""Camera trajectories as text, in the form of the TUM RGB-D benchmark: ``timestamp tx ty tz qx qy qz qw`` a line, seconds and metres.

The pose is that of the optical frame in the world (https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats).
"""

import math
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

from scene_description.errors import SceneSynthError, read_at_most
from scene_description.strict import FieldError, shorten
from scene_description.types import MAX_POSES, CameraPose

_SECOND_NS = 1_000_000_000
_MOST_M = 1000.0
MAX_TEXT_LENGTH = 64_000_000


def trajectory_to_tum(poses: Sequence[CameraPose]) -> str:
    """Return the text of a trajectory; numbers are exact, stamps to the nanosecond."""
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for pose in poses:
        numbers = " ".join(repr(float(value)) for value in (*pose.position_m, *pose.orientation))
        lines.append(f"{stamp_text(pose.stamp_ns)} {numbers}")
    return "\n".join(lines) + "\n"


def stamp_text(stamp_ns: int) -> str:
    """Return a stamp in seconds, exact."""
    seconds, nanoseconds = divmod(stamp_ns, _SECOND_NS)
    return f"{seconds}.{nanoseconds:09d}"


def stamp_name(stamp_ns: int) -> str:
    """Return a stamp as names of files have it: seconds with ten digits, so that they sort by time."""
    seconds, nanoseconds = divmod(stamp_ns, _SECOND_NS)
    return f"{seconds:010d}.{nanoseconds:09d}"


def read_tum_trajectory(path: Path, error: type[SceneSynthError]) -> tuple[CameraPose, ...]:
    """Read the file of a trajectory.

    Raises:
        error: it is too long.
        FieldError: as :func:`trajectory_from_tum`.
        OSError: it cannot be read.
    """
    return trajectory_from_tum(read_at_most(path, MAX_TEXT_LENGTH, error).decode(errors="replace"), str(path))


def trajectory_from_tum(text: str, name: str = "trajectory") -> tuple[CameraPose, ...]:
    """Read a trajectory; lines that begin with # and empty ones are skipped, quaternions near unit length are made so.

    Raises:
        FieldError: a line has another form, stamps do not increase, or there are none or too many; one line with the line's number.
    """
    if len(text) > MAX_TEXT_LENGTH:
        raise FieldError(name, f"at most {MAX_TEXT_LENGTH} characters", f"{len(text)}")
    poses: list[CameraPose] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(poses) == MAX_POSES:
            raise FieldError(name, f"at most {MAX_POSES} poses", "more")
        pose = _read_line(words, f"{name} line {number}")
        if poses and pose.stamp_ns <= poses[-1].stamp_ns:
            raise FieldError(f"{name} line {number}", "timestamps that increase", words[0][:40])
        poses.append(pose)
    if not poses:
        raise FieldError(name, "lines 'timestamp tx ty tz qx qy qz qw'", "none")
    return tuple(poses)


def _read_line(words: list[str], where: str) -> CameraPose:
    if len(words) != 8:
        raise FieldError(where, "8 numbers: timestamp tx ty tz qx qy qz qw", f"{len(words)} words")
    try:
        seconds, numbers = Decimal(words[0]), [float(word) for word in words[1:]]
    except (InvalidOperation, ValueError):
        raise FieldError(where, "8 numbers: timestamp tx ty tz qx qy qz qw", shorten(" ".join(words))) from None
    length = math.hypot(*numbers[3:])
    if not seconds.is_finite() or not 0 <= seconds <= 4_000_000_000:
        raise FieldError(where, "a timestamp in [0, 4e9] s", words[0][:40])
    if not all(math.isfinite(value) and abs(value) <= _MOST_M for value in numbers) or abs(length - 1.0) > 0.01:
        raise FieldError(where, f"a position within {_MOST_M:g} m and a unit quaternion", shorten(" ".join(words[1:])))
    tx, ty, tz, qx, qy, qz, qw = numbers
    return CameraPose(
        stamp_ns=int(seconds * _SECOND_NS),
        position_m=(tx, ty, tz),
        orientation=(qx / length, qy / length, qz / length, qw / length),
    )
