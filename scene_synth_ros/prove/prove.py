"""All checks of a bag, room by room, and what they have found."""

import json
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar
from xml.etree import ElementTree

import numpy as np

from scene_description import SceneSynthError
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.prove import consistency, inertia, pictures, ranges, wheels
from scene_synth_ros.prove.bag import ReadBag
from scene_synth_ros.prove.evidence import Evidence, Messages, Room
from scene_synth_ros.prove.verdict import Verdict

T = TypeVar("T")
Check = Callable[[Evidence, Room], Iterator[Verdict]]

CHECKS: Mapping[str, Check] = {
    "stamps": consistency.stamps,
    "clock": consistency.clock,
    "frames": consistency.frames,
    "camera_info": consistency.camera_info,
    "depth": pictures.depth_and_ids,
    "reprojection": pictures.reprojection,
    "color": pictures.color,
    "motion": inertia.motion,
    "imu": inertia.imu,
    "imu_noise": inertia.imu_noise,
    "wheels": wheels.wheels,
    "odometry": wheels.odometry,
    "scan": ranges.scan,
    "scan_noise": ranges.scan_noise,
    "lidar": ranges.lidar,
    "lidar_noise": ranges.lidar_noise,
}
"""Name -> check of a room; ``depth`` speaks of ids and normals, too."""
_MESSAGE_ERRORS = (
    SceneSynthError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, struct.error,
    ElementTree.ParseError, np.linalg.LinAlgError,
)  # fmt: skip
"""What comes of messages that are not what their types say."""


class Proof(NamedTuple):
    """What was found in a bag: every measure, and lines on what could not be read."""

    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...] = ()

    @property
    def good(self) -> bool:
        """Whether something was checked, and nothing is wrong."""
        return any(verdict.checked for verdict in self.verdicts) and not self.faults and not self.notes

    @property
    def faults(self) -> tuple[Verdict, ...]:
        """Measures beyond their limits."""
        return tuple(verdict for verdict in self.verdicts if not verdict.good)


def prove_bag(bag: Path, catalog_dir: Path | None = None, progress: Callable[[str], None] = lambda _: None) -> Proof:
    """Check a bag.

    ``catalog_dir``: folder of the user's models, where the run had one; ``progress`` is told what is checked.

    Raises:
        SceneSynthError: the bag cannot be read.
    """
    notes: list[str] = []
    with closing(ReadBag(bag, notes.append)) as messages:
        proof = prove_messages(messages, catalog_dir, progress)
        found, of_files = _found("digests", messages.digests)
    return Proof((*found, *proof.verdicts), (*dict.fromkeys([*notes, *of_files, *proof.notes]),))


def prove_messages(messages: Messages, catalog_dir: Path | None = None, progress: Callable[[str], None] = lambda _: None) -> Proof:
    """Check messages, all but whether files hold what they say; a check that cannot read them says so in a note."""
    progress("reading")
    evidence = Evidence(messages, catalog_dir, {roles.LIDAR_IDEAL: ranges.read_sweep})
    rooms, notes = _found("scene", lambda: evidence.rooms)
    verdicts: list[Verdict] = []
    for number, room in enumerate(rooms, 1):
        for name, check in CHECKS.items():
            progress(f"room {number} of {len(rooms)}: {name}")
            found, refused = _found(name, partial(check, evidence, room))
            verdicts, notes = verdicts + found, notes + refused
    return Proof(tuple(verdicts), tuple(notes))


def _found(name: str, look: Callable[[], Iterable[T]]) -> tuple[list[T], list[str]]:
    """Return what a check yields, and a line where messages are not such as it can read."""
    try:
        return list(look()), []
    except _MESSAGE_ERRORS as error:
        return [], [f"{name}: expected messages that can be checked, got {' '.join(str(error).split())[:200]}"]


def lines_of(proof: Proof) -> Iterator[str]:
    """Yield a line for each check, of what it found worst, and one for each fault."""
    for name, verdicts in by_check(proof.verdicts).items():
        faults = [verdict for verdict in verdicts if not verdict.good]
        checked = sum(verdict.checked for verdict in verdicts)
        if not faults:
            closest = max(verdicts, key=lambda verdict: verdict.worst / verdict.limit if verdict.limit else 0.0)
            yield f"good   {name}: {checked} values; nearest to its limit: {closest.detail} {_figure(closest)}"
        for verdict in faults:
            where = f" at {verdict.stamp_ns / 1e9:.9f} s" if verdict.stamp_ns >= 0 else ""
            yield f"fault  {name}: {verdict.topic}{where}: {verdict.detail} {_figure(verdict)}"
    yield from (f"fault  {note}" for note in proof.notes)


def _figure(verdict: Verdict) -> str:
    unit = f" {verdict.unit}" if verdict.unit else ""
    return f"{verdict.worst:.4g}{unit}, at most {verdict.limit:.4g}{unit}"


def by_check(verdicts: Iterable[Verdict]) -> dict[str, list[Verdict]]:
    """Return name of the check -> its measures that say something, in the order in which they came."""
    found: dict[str, list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.checked:
            found.setdefault(verdict.check, []).append(verdict)
    return found


def proof_to_json(proof: Proof) -> str:
    """Return everything that was found as JSON; infinite measures as null."""
    rows = [verdict._asdict() | {"worst": verdict.worst if np.isfinite(verdict.worst) else None} for verdict in proof.verdicts]
    return json.dumps({"schema": "scene_synth/proof/1", "good": bool(proof.good), "notes": proof.notes, "verdicts": rows}, default=_plain)


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else str(value)
