"""A user's Python algorithm: how it is loaded, what it is given, and how what it raises is told in one line."""

import importlib.util
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.evaluate.errors import EvaluateError

POSE_INPUT = "pose"
DEFAULT_INPUTS = ("color",)
THIS, NEXT, PREVIOUS = "", "next", "previous"
"""Which frame an input is of, as its name says after ``@``; nothing: of the frame that is judged."""


def layer_of(name: str) -> str:
    """Return the layer of an input, ``color`` of ``color@next``."""
    return name.partition("@")[0]


def frame_of(name: str) -> str:
    """Return which frame an input is of."""
    return name.partition("@")[2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlgorithmFrame:
    """One view, as an algorithm gets it.

    Attributes:
        stamp_ns: simulated time.
        K: (3, 3) float64, the camera's intrinsic matrix in pixels; zero for a panorama.
        width: of the images, pixels.
        height: of the images, pixels.
        images: by the names in ``inputs``, read-only: ``color`` (height, width, 3) uint8; others as their layer says; ``color@next`` and
            ``color@previous`` of the frame after this one and of that before it.
        D: distortion coefficients, as CameraInfo has them.
        projections: (3, 4) float64 by the names in ``inputs``, CameraInfo's P: the second camera of a stereo pair has -fx * baseline in it.
        world_from_camera: (4, 4) float64, the true pose of the optical frame; None unless ``inputs`` has ``pose``.
        room: position of the room in its bag.
    """

    stamp_ns: int
    K: NDArray[np.float64]
    width: int
    height: int
    images: Mapping[str, NDArray[Any]]
    D: NDArray[np.float64]
    projections: Mapping[str, NDArray[np.float64]]
    world_from_camera: NDArray[np.float64] | None
    room: int


class Algorithm:
    """The callable or class ``NAME`` of ``FILE.py:NAME``.

    A callable is called with each :class:`AlgorithmFrame`; a class is constructed, without arguments, for each room, and its object is
    called. Its attribute ``inputs`` names what it is given: layers of the camera (``color``, ``depth_sensed``), of another camera
    (``right/color``), of the neighbouring frames (``color@next``, ``color@previous``), and ``pose`` for the true pose; without it,
    ``color``. It returns a mapping task -> estimate; a task that is left out, or None in place of the mapping, is no estimate of the
    frame. It is not called for a room's first or last frame where that lacks the neighbour.

    Raises:
        EvaluateError: there is no such file or name, or the file cannot be loaded.
    """

    def __init__(self, words: str) -> None:
        self.words = words
        file, separator, name = words.rpartition(":")
        if not separator or not name.isidentifier() or not file.endswith(".py"):
            raise EvaluateError(f"--algorithm {words}: expected FILE.py:NAME, for example my_depth.py:estimate")
        self._file = Path(file)
        if not self._file.is_file():
            raise EvaluateError(f"--algorithm {words}: expected a Python file, got none at {file}; check the path")
        module = self._load()
        made = getattr(module, name, None)
        if not callable(made):
            known = sorted(
                key for key, value in vars(module).items() if callable(value) and getattr(value, "__module__", "") == module.__name__
            )
            raise EvaluateError(f"--algorithm {words}: expected a callable or class '{name}' in {file}, got {', '.join(known) or 'none'}")
        inputs = getattr(made, "inputs", DEFAULT_INPUTS)
        if isinstance(inputs, str) or not all(isinstance(word, str) for word in inputs):
            raise EvaluateError(f"--algorithm {words}: expected inputs as a tuple of names such as ('color', 'pose'), got {inputs!r:.80}")
        odd = [word for word in inputs if "@" in word and frame_of(word) not in (NEXT, PREVIOUS)]
        if odd:
            near = f"{layer_of(odd[0])}@{NEXT} or {layer_of(odd[0])}@{PREVIOUS}"
            raise EvaluateError(f"--algorithm {words}: inputs: expected {near} for a neighbouring frame, got {odd[0]!r:.80}")
        self.inputs: tuple[str, ...] = tuple(inputs)
        self._made: Callable[..., Any] = made
        self._call: Callable[[AlgorithmFrame], Any] = made

    def __reduce__(self) -> "tuple[type[Algorithm], tuple[str]]":
        """Let another process load its own."""
        return Algorithm, (self.words,)

    @property
    def layers(self) -> tuple[str, ...]:
        """The images that it asks for."""
        return tuple(name for name in self.inputs if name != POSE_INPUT)

    def begin_room(self, room: int) -> None:
        """Construct the class anew.

        Raises:
            EvaluateError: it raised something.
        """
        if isinstance(self._made, type):
            try:
                self._call = self._made()
            except Exception as error:
                self._refuse(error, f"when it was constructed for room {room}")

    def estimate(self, frame: AlgorithmFrame) -> Mapping[str, Any]:
        """Return task -> estimate of a frame; empty if there is none.

        Raises:
            EvaluateError: the algorithm raised something, or returned no mapping.
        """
        where = f"at stamp {frame.stamp_ns} of room {frame.room}"
        found: Any = None
        try:
            found = self._call(frame)
        except Exception as error:
            self._refuse(error, where)
        if found is not None and not isinstance(found, Mapping):
            got = type(found).__name__
            raise EvaluateError(f'--algorithm {self.words}: expected a mapping such as {{"depth": array}} {where}, got {got}')
        return found or {}

    def _load(self) -> ModuleType:
        spec = importlib.util.spec_from_file_location(f"evaluated_{self._file.stem}", self._file)
        if spec is None or spec.loader is None:
            raise EvaluateError(f"--algorithm {self.words}: {self._file} is no Python file")
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # dataclasses of the file look themselves up there
        sys.path.insert(0, str(self._file.parent.absolute()))
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            self._refuse(error, "when it was loaded")
        return module

    def _refuse(self, error: Exception, when: str) -> NoReturn:
        """Tell what the user's code raised, with its line there."""
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if Path(frame.filename).absolute() == self._file.absolute()]
        line = f" in line {own[-1].lineno}" if own else f" in line {error.lineno}" if isinstance(error, SyntaxError) else ""
        said = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        raise EvaluateError(f"--algorithm {self.words}: it raised {said}{line} {when}; run the file by itself to see more") from error
