"""A dataset in an object store, by an fsspec URL: ``s3://bucket/folder``, or any other that writes whole objects (GCS, Azure, ``memory://``).

A shard is made in a temporary folder of the machine and uploaded file by file; an object is there whole or not at all, and nothing of a
shard counts without its completion file, which comes last.  What is uploaded twice, by a task that was started again while the first
still lived, is replaced by the same bytes.  Extra ``cloud``.
"""

import contextlib
import importlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from scene_description import SceneSynthError
from scene_synth_ros.bags.dataset_files import SHARDS_NAME
from scene_synth_ros.shards.store import sha256_of
from scene_synth_ros.workers.temporary_folder import remove_abandoned_folders, temporary_folder


class StoreError(SceneSynthError):
    """A URL that cannot be used or reached; one line."""


@dataclass(frozen=True, slots=True)
class UrlStore:
    """A dataset below a URL; does as :class:`scene_synth_ros.shards.store.Store` says.

    Credentials and endpoints come from where the file system's own library takes them, from ``AWS_ACCESS_KEY_ID`` and
    ``AWS_ENDPOINT_URL_S3``, say.
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

    def sha256(self, name: str) -> str | None:
        """Return the SHA-256 of a file, in hexadecimal; None where there is none."""
        with self._told(name) as (files, path):
            try:
                with files.open(path, "rb") as file:
                    return sha256_of(file)
            except FileNotFoundError:
                return None

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

    def sizes(self, folder: str) -> dict[str, int]:
        """Return the bytes of the files in a folder and in those that it holds, by their names in it: one listing."""
        with self._told(folder) as (files, path):
            found = files.find(path, detail=True)
        return {name.removeprefix(path).lstrip("/"): int(row["size"] or 0) for name, row in found.items()}

    @contextlib.contextmanager
    def workspace(self, shard: str) -> Iterator[Path]:
        """Give a temporary folder of this machine."""
        with temporary_folder() as folder:
            yield folder

    def put_folder(self, made: Path, name: str) -> None:
        """Upload a folder of files over one of its name; what that had besides is removed in the end."""
        with self._told(name) as (files, path):
            objects = {f"{path}/{file.name}": str(file) for file in sorted(made.iterdir())}
            for target, file in objects.items():
                files.put_file(file, target)
            self._remove([target for target in self._files(path) if target not in objects])

    @contextlib.contextmanager
    def fetched(self, name: str) -> Iterator[Path]:
        """Give a folder of files, downloaded into a temporary one."""
        with temporary_folder() as around:
            folder = around / name.rpartition("/")[2]
            folder.mkdir()
            with self._told(name) as (files, path):
                for file in self._files(path):
                    files.get_file(file, str(folder / file.rpartition("/")[2]))
            yield folder

    def remove(self, name: str) -> None:
        """Remove a file or a folder; harmless where there is none."""
        with self._told(name) as (_, path):
            self._remove(self._files(path))

    def clean(self, shards: Collection[str] | None = None) -> int:
        """Remove the files of shards without a completion file, parts of interrupted uploads, and what was left of them on this machine."""
        remove_abandoned_folders()
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

    def _files(self, path: str) -> list[str]:
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
