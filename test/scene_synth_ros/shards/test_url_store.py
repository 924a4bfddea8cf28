"""A dataset in an object store: what the store promises, against moto's S3 server."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest
from s3_server import BUCKET, s3_server

from scene_synth_ros.shards.url_store import StoreError, UrlStore, file_system


@pytest.fixture(scope="module")
def server() -> Iterator[None]:
    with s3_server():
        yield


@pytest.fixture
def store(server: None, request: pytest.FixtureRequest) -> UrlStore:
    return UrlStore(f"s3://{BUCKET}/{request.node.name}")


def folder_of(root: Path, **texts: str) -> Path:
    root.mkdir(parents=True)
    for name, text in texts.items():
        (root / f"{name}.mcap").write_text(text)
    return root


def test_files_are_read_listed_and_removed(store: UrlStore, tmp_path: Path) -> None:
    assert store.read("dataset.json") is None
    assert store.names("") == []
    store.write("dataset.json", b"{}")
    store.write("dataset.json", b"{1}")
    store.put_folder(folder_of(tmp_path / "made", a="A", b="B"), "shards/00000")
    store.write("shards/00000.json", b"{2}")
    store.write("shards/.hidden", b"")
    assert store.names("") == ["dataset.json", "shards"]
    assert store.names("shards") == ["00000", "00000.json"]
    assert store.read("dataset.json") == b"{1}"
    with store.open("shards/00000/b.mcap") as file:
        assert file.read(1) == b"B"
    store.remove("shards/00000")
    assert store.names("shards") == ["00000.json"]
    store.remove("shards/00000.json")
    store.remove("shards/00000.json")
    assert store.names("shards") == []
    with pytest.raises(FileNotFoundError):
        store.open("shards/00000/b.mcap")


def test_what_others_have_written_since_a_listing_is_read(store: UrlStore) -> None:
    store.write("shards/00000.json", b"0")
    assert store.names("shards") == ["00000.json"]
    assert store.read("shards/00001.json") is None
    bucket, key, _ = fsspec.filesystem("s3").split_path(f"{store.url}/shards/00001.json")
    fsspec.filesystem("s3").call_s3("put_object", Bucket=bucket, Key=key, Body=b"1")
    assert store.read("shards/00001.json") == b"1"
    with store.open("shards/00001.json") as file:
        assert file.read() == b"1"
    assert store.names("shards") == ["00000.json", "00001.json"]


def test_a_folder_replaces_what_was_there_and_no_object_is_missing_meanwhile(store: UrlStore, tmp_path: Path) -> None:
    store.put_folder(folder_of(tmp_path / "one", a="A", old="O"), "shards/00001")
    removed: list[list[str]] = []
    files, _ = file_system(store.url)
    rm = files.rm
    files.rm = lambda paths, **more: (removed.append([path.rpartition("/")[2] for path in paths]), rm(paths, **more))
    try:
        store.put_folder(folder_of(tmp_path / "two", a="B"), "shards/00001")
    finally:
        files.rm = rm
    assert removed == [["old.mcap"]]
    assert store.names("shards/00001") == ["a.mcap"]
    assert store.read("shards/00001/a.mcap") == b"B"


def test_an_interrupted_upload_leaves_nothing_that_is_listed_and_is_dropped(store: UrlStore) -> None:
    files, root = fsspec.core.url_to_fs(store.url)
    bucket, key, _ = files.split_path(f"{root}/shards/00002/big.mcap")
    other = f"{key.rpartition('/')[0]}0/big.mcap"
    for each in (key, other):
        begun = files.call_s3("create_multipart_upload", Bucket=bucket, Key=each)
        files.call_s3("upload_part", Bucket=bucket, Key=each, UploadId=begun["UploadId"], PartNumber=1, Body=b"half")
    assert store.names("shards") == []
    assert store.clean({"00002"}) == 1
    assert [upload["Key"] for upload in files.list_multipart_uploads(bucket)] == [other]
    assert store.clean() == 1
    assert files.list_multipart_uploads(bucket) == []


def test_shards_without_a_completion_file_are_removed_those_that_are_asked_for(store: UrlStore, tmp_path: Path) -> None:
    for name in ("00000", "00001", "00002"):
        store.put_folder(folder_of(tmp_path / name, a=name), f"shards/{name}")
    store.write("shards/00000.json", b"{}")
    assert store.clean({"00000", "00001"}) == 1
    assert store.names("shards") == ["00000", "00000.json", "00002"]
    with store.fetched("shards/00000") as local:
        assert [path.read_text() for path in local.iterdir()] == ["00000"]


def test_workspaces_end_and_those_of_killed_processes_are_removed(store: UrlStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    call = "S('').workspace('7') as w: os.write(1, bytes(w)), os._exit(9)"
    say = f"import os; from scene_synth_ros.shards.url_store import UrlStore as S\nwith {call}"
    root = str(Path(__file__).parents[3])
    env = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": root}
    left = Path(subprocess.run([sys.executable, "-c", say], env=env, capture_output=True, text=True, check=False).stdout.strip())
    assert left.is_dir()
    with store.workspace("00000") as one:
        assert not left.exists()
        with store.workspace("00000") as two:
            assert one != two
            assert one.is_dir()
            assert two.is_dir()
    assert not one.exists()
    assert not two.exists()


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("nowhere://bucket/x", "nowhere://bucket/x: expected a URL that fsspec knows"),
        ("s3://absent/x", "s3://absent/x/dataset.json: The specified bucket does not exist"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(server: None, url: str, says: str) -> None:
    with pytest.raises(StoreError, match=says) as raised:
        UrlStore(url).write("dataset.json", b"{}")
    assert "\n" not in str(raised.value)
