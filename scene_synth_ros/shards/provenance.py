"""What the bytes of a dataset depend on beside the words of its plan: the program, what it has read, its libraries, the processor."""

import hashlib
import json
import platform
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import llvmlite.binding
import lz4
import zstandard
from PIL import features

from grammar.spec.grammar_file import grammar_sources
from kernel_cache.processor import AVX512, COMMON, maker
from scene_description import Limits, SceneSynthError, from_mapping
from scene_description.share import config_path
from scene_synth_ros.bags.run_info import PACKAGES, versions
from scene_synth_ros.shards.store import sha256_of

_PROGRAM = ("kernel_cache", "scene_description", "grammar", "renderer", "scene_synth_ros")
"""Packages that make bytes; ``evaluation`` judges them."""
_SOURCES = {".py", ".csv", ".msg"}
_CONFIGURATION = (
    "categories.yaml",
    "appearance.yaml",
    "materials.yaml",
    "lighting.yaml",
    "camera.yaml",
    "small_things.yaml",
    "models.yaml",
    "grammars",
    "learned",
)
"""What rooms are sampled by; presets, cameras and other profiles come into the plan as parameters."""
_DIGITS = 16

_Facts = Annotated[Mapping[str, Annotated[str, Limits(max_length=200)]], Limits(max_length=100)]


class ProvenanceError(SceneSynthError):
    """Shards of a dataset that two programs would make; one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What made a shard; shards of equal plans and equal provenances have equal bytes.

    Attributes:
        program: package -> digest of its source files.
        configuration: what was read -> its digest: the plan's parameters, files and folders of ``config/``, the user's own.
        versions: what changes bytes -> its version: this package, Python, libraries, the codecs within them.
        processor: ``features`` -> ``AVX2`` or ``AVX-512``, by which of them rays are traced, all else being the same on processors with
            AVX2; name of the processor and digest of what it can do where it has none, or where pictures are denoised.
    """

    program: _Facts
    configuration: _Facts
    versions: _Facts
    processor: _Facts

    def difference(self, other: "Provenance", named: int = 4) -> str:
        """Return in words in what another one differs, so many of them by name: here and there; empty if in nothing."""
        told = []
        for field in fields(self):
            one, two = getattr(self, field.name), getattr(other, field.name)
            for name in sorted({*one, *two}):
                if one.get(name) != two.get(name):
                    values = f" {one.get(name, 'none')} here, {two.get(name, 'none')} there"
                    told.append(f"{name} ({field.name})" if field.name in ("program", "configuration") else name + values)
        return "; ".join(told[:named]) + (f"; {len(told) - named} more" if len(told) > named else "")

    def to_mapping(self) -> dict[str, dict[str, str]]:
        """Return what JSON has of it."""
        return asdict(self)


def provenance_of(words: Mapping[str, Any], *, portable: bool, denoised: bool) -> Provenance:
    """Return the provenance of what this process makes.

    Files are read once a process, as rooms are made by what was read once.

    Args:
        words: of the plan that decide the bytes of rooms, with ``parameters``.
        portable: whether every renderer is.
        denoised: whether any renderer denoises, with a library that has code of its own for every kind of processor.

    Raises:
        OSError, SceneSynthError: a file of the user's cannot be read.
    """
    nodes: Mapping[str, Mapping[str, Any]] = words["parameters"]
    folders = {str(values["catalog_dir"]) for values in nodes.values() if values.get("catalog_dir")}
    own = _own_files(str(nodes["grammar_node"].get("grammar_file", "")), tuple(sorted(folders)))
    parameters = _digest([json.dumps(words, sort_keys=True).encode()])
    return Provenance(
        program=_program(),
        configuration={"parameters": parameters, **_shipped(), **own},
        versions=_versions(),
        processor={"features": _processor() if denoised or not COMMON else "AVX2" if portable else _traced_by()},
    )


def read_provenance(document: object) -> Provenance:
    """Return a provenance as JSON has it.

    Raises:
        FieldError: it does not fit.
    """
    return from_mapping(Provenance, document, "provenance")


def admit(known: tuple[Provenance, ...], made_by: Iterable[Provenance], where: str, *, accept: bool) -> tuple[Provenance, ...]:
    """Return the provenances of a dataset with further ones.

    ``known``: those of its plan, the first of which began it.
    ``made_by``: of shards that are there, or will be made.

    Raises:
        ProvenanceError: there is another one, which is not accepted; the line tells in what it differs.
    """
    for one in made_by:
        if one not in known:
            if not accept:
                told = one.difference(known[0])
                raise ProvenanceError(
                    f"{where}: expected shards of one program, configuration and kind of machine, got others: {told}; "
                    "go on with what began the dataset, choose another folder, or say --accept-mixed, which is recorded"
                )
            known = (*known, one)
    return known


@lru_cache(maxsize=1)
def _program() -> dict[str, str]:
    root = Path(__file__).resolve().parents[2]
    return {name: _digest_of_folder(root / name, _SOURCES) for name in _PROGRAM}


@lru_cache(maxsize=1)
def _shipped() -> dict[str, str]:
    return {name: _digest_of(config_path(name)) for name in _CONFIGURATION}


@lru_cache(maxsize=1)
def _own_files(grammar_file: str, folders: tuple[str, ...]) -> dict[str, str]:
    found = {f"catalog_dir {number}": _digest_of_folder(Path(folder)) for number, folder in enumerate(folders)}
    if grammar_file:
        found["grammar_file"] = _digest(path.read_bytes() for path in grammar_sources(Path(grammar_file)))
    return found


@lru_cache(maxsize=1)
def _versions() -> dict[str, str]:
    codecs = {
        "zlib": zlib.ZLIB_RUNTIME_VERSION,
        "zlib of pillow": features.version("zlib_ng") or features.version("zlib"),
        "libjpeg of pillow": features.version("libjpeg_turbo") or features.version("jpg"),
        "zstd": ".".join(map(str, zstandard.ZSTD_VERSION)),
        "lz4": lz4.library_version_string(),
    }
    of_packages = {name: versions()[name] for name in ("scene_synth_ros", *PACKAGES)}
    with_denoiser = {"pyoidn": next((found.version for found in metadata.distributions(name="pyoidn")), "none")}
    major, minor, _ = platform.python_version_tuple()
    return {"python": f"{major}.{minor}", **of_packages, **with_denoiser, **{name: str(version) for name, version in codecs.items()}}


def _traced_by() -> str:
    """Return what rays depend on where renderers are not portable."""
    return f"{'AVX-512' if AVX512 else 'AVX2'} of {maker()}"


@lru_cache(maxsize=1)
def _processor() -> str:
    """Return the processor's name and a digest of what it can do."""
    return f"{llvmlite.binding.get_host_cpu_name()} {_digest([llvmlite.binding.get_host_cpu_features().flatten().encode()])}"


def _digest_of(path: Path) -> str:
    return _digest_of_folder(path) if path.is_dir() else _digest([path.read_bytes()])


def _digest_of_folder(folder: Path, endings: set[str] | None = None) -> str:
    """Return a digest of the names and contents of the files below a folder, of some kinds or of all."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and (endings is None or path.suffix in endings) and "__pycache__" not in path.parts:
            with path.open("rb") as file:
                digest.update(f"{path.relative_to(folder).as_posix()}\0{sha256_of(file)}\0".encode())
    return digest.hexdigest()[:_DIGITS]


def _digest(pieces: Iterable[bytes]) -> str:
    digest = hashlib.sha256()
    for piece in pieces:
        digest.update(hashlib.sha256(piece).digest())
    return digest.hexdigest()[:_DIGITS]
