"""A dataset in an object store, by an fsspec URL: ``s3://bucket/folder``, or any other that writes whole objects (GCS, Azure, ``memory://``).

A shard is made in a temporary folder of the machine and uploaded file by file; an object is there whole or not at all, and nothing of a
shard counts without its completion file, which comes last.  What is uploaded twice, by a task that was started again while the first
still lived, is replaced by the same bytes.  Extra ``cloud``.
"""

from __future__ import annotations

import contextlib
import fcntl
import importlib
import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, cast

from scene_description import SceneSynthError
from scene_synth_ros.bags.dataset_files import SHARDS_NAME

_WORKSPACES = "scene_synth_shards"
_LOCK = ".lock"


class StoreError(SceneSynthError):
    """A URL that cannot be used or reached; one line."""


@dataclass(frozen=True, slots=True)
class UrlStore:
    """A dataset below a URL; does as :class:`scene_synth_ros.shards.store.Store` says.

    Credentials and endpoints come from where the file system's own library takes them, from ``AWS_ACCESS_KEY_ID`` and
    ``AWS_ENDPOINT_URL_S3``, say.

    Args:
        url: of the folder.
    """

    url: str

    @property
    def where(self) -> str:
        """The URL."""
        return self.url

    def read(self, name: str) -> bytes | None:
        """Return a small file, None where there is none."""
        with self._told(name) as (files, path):
            try:
                return cast(bytes, files.cat_file(path))
            except FileNotFoundError:
                return None

    def open(self, name: str) -> BinaryIO:
        """Open a file for reading in pieces; FileNotFoundError where there is none."""
        files, root = file_system(self.url)
        return cast(BinaryIO, files.open(f"{root}/{name}", "rb"))

    def write(self, name: str, data: bytes) -> None:
        """Write a small file, in place of one of its name."""
        with self._told(name) as (files, path):
            files.pipe_file(path, data)

    def names(self, folder: str) -> list[str]:
        """Return the names of what lies in a folder, in order; temporary things are left out; nothing where there is no folder."""
        with self._told(folder) as (files, path):
            try:
                found = [entry.rstrip("/").rpartition("/")[2] for entry in files.ls(path, detail=False)]
            except FileNotFoundError:
                return []
        return sorted(name for name in found if not name.startswith("."))

    @contextlib.contextmanager
    def workspace(self, shard: str) -> Iterator[Path]:
        """Give a temporary folder of this machine; those that killed processes have left beside it are removed."""
        parent = Path(tempfile.gettempdir()) / f"{_WORKSPACES}_{os.getuid()}"
        parent.mkdir(mode=0o700, exist_ok=True)
        _remove_abandoned(parent)
        folder = Path(tempfile.mkdtemp(prefix=f"{shard}_", dir=parent))
        with (folder / _LOCK).open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            try:
                yield folder
            finally:
                shutil.rmtree(folder, ignore_errors=True)

    def put_folder(self, made: Path, name: str) -> None:
        """Upload a folder of files over one of its name; what that had besides is removed in the end."""
        with self._told(name) as (files, path):
            wanted = {f"{path}/{file.name}": file for file in sorted(made.iterdir())}
            for target, file in wanted.items():
                files.put_file(str(file), target)
            self._remove([found for found in self._found(path) if found not in wanted])

    @contextlib.contextmanager
    def fetched(self, name: str) -> Iterator[Path]:
        """Give a folder of files, downloaded into a temporary one."""
        with tempfile.TemporaryDirectory(prefix="scene_synth_") as folder:
            with self._told(name) as (files, path):
                for found in self._found(path):
                    files.get_file(found, str(Path(folder) / found.rpartition("/")[2]))
            yield Path(folder)

    def remove(self, name: str) -> None:
        """Remove a file or a folder; harmless where there is none."""
        with self._told(name) as (_, path):
            self._remove(self._found(path))

    def clean(self, shards: Collection[str] | None = None) -> int:
        """Remove the files of shards that have no completion file, and the parts of uploads that were interrupted."""
        there = set(self.names(SHARDS_NAME))
        unfinished = {name for name in there if not name.endswith(".json") and f"{name}.json" not in there}
        for name in sorted(unfinished if shards is None else unfinished & set(shards)):
            self.remove(f"{SHARDS_NAME}/{name}")
        with self._told(SHARDS_NAME) as (files, path):
            aborted = _abort_uploads(files, path, shards)
        return len(unfinished if shards is None else unfinished & set(shards)) + aborted

    @contextlib.contextmanager
    def _told(self, name: str) -> Iterator[tuple[Any, str]]:
        """Give the file system and the path of a name; whatever its library says is told in one line.

        Raises:
            StoreError: the store cannot be used.
        """
        files, root = file_system(self.url)
        try:
            yield files, f"{root}/{name}".rstrip("/")
        except SceneSynthError:
            raise
        except Exception as error:  # of whatever library reaches the store; those of S3 have several roots
            raise StoreError(f"{self.url}/{name}: {' '.join(str(error).split()) or type(error).__name__}") from None

    def _found(self, path: str) -> list[str]:
        files, _ = file_system(self.url)
        return cast("list[str]", files.find(path))

    def _remove(self, paths: list[str]) -> None:
        files, _ = file_system(self.url)
        if paths:
            files.rm(paths)


def file_system(url: str) -> tuple[Any, str]:
    """Return the fsspec file system of a URL, one a process, and the path in it.

    Raises:
        StoreError: fsspec or the library of the URL's kind is missing, or the URL is of no kind that is known.
    """
    try:
        core = importlib.import_module("fsspec.core")
        files, path = core.url_to_fs(url, use_listings_cache=False)  # others write there, too
    except ImportError as error:
        raise StoreError(f"{url}: needs a library that is not installed ({error.msg}): pip install 'scene_synth_ros[cloud]'") from None
    except ValueError as error:
        raise StoreError(f"{url}: expected a URL that fsspec knows, s3://bucket/folder, say; {error}") from None
    return files, path.rstrip("/")


def _abort_uploads(files: Any, path: str, shards: Collection[str] | None) -> int:
    """Drop what was uploaded of interrupted uploads to S3, in no listing but paid for; return how many there were of the shards."""
    if "s3" not in files.protocol:
        return 0
    bucket, key, _ = files.split_path(path)
    aborted = 0
    with contextlib.suppress(PermissionError, NotImplementedError):  # it is no more than tidy
        found = files.call_s3("list_multipart_uploads", Bucket=bucket, Prefix=f"{key}/")
        for upload in found.get("Uploads", []):
            if shards is None or upload["Key"].removeprefix(f"{key}/").partition("/")[0] in shards:
                files.call_s3("abort_multipart_upload", Bucket=bucket, Key=upload["Key"], UploadId=upload["UploadId"])
                aborted += 1
    return aborted


def _remove_abandoned(parent: Path) -> None:
    """Remove the workspaces of processes that are gone: nobody holds their locks."""
    for folder in parent.iterdir():
        with contextlib.suppress(OSError), (folder / _LOCK).open("r+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
