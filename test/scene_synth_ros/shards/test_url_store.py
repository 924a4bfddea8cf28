"""A dataset in an object store: what the store promises, against moto's S3 server."""

import hashlib
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest
from s3_server import BUCKET, forget_clients, s3_server

from scene_synth_ros.shards.completion import FileRow, faults_of
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
    assert store.sha256("shards/00000/b.mcap") == hashlib.sha256(b"B").hexdigest()
    store.remove("shards/00000")
    assert store.names("shards") == ["00000.json"]
    store.remove("shards/00000.json")
    store.remove("shards/00000.json")
    assert store.names("shards") == []
    assert store.sha256("shards/00000/b.mcap") is None


def test_what_others_have_written_since_a_listing_is_read(store: UrlStore) -> None:
    store.write("shards/00000.json", b"0")
    assert store.names("shards") == ["00000.json"]
    assert store.read("shards/00001.json") is None
    bucket, key, _ = fsspec.filesystem("s3").split_path(f"{store.url}/shards/00001.json")
    fsspec.filesystem("s3").call_s3("put_object", Bucket=bucket, Key=key, Body=b"1")
    assert store.read("shards/00001.json") == b"1"
    assert store.sha256("shards/00001.json") == hashlib.sha256(b"1").hexdigest()
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


def test_a_run_removes_the_workspaces_of_its_killed_workers(store: UrlStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / ".scene_synth_12345678.locked").mkdir()
    assert store.clean({"00000"}) == 0
    assert list(tmp_path.iterdir()) == []


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


def test_a_store_that_fails_while_files_are_checked_ends_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = FileRow(name="00000/bag.mcap", bytes=1, sha256="")
    with s3_server():
        store = UrlStore(f"s3://{BUCKET}/checked")
        store.put_folder(folder_of(tmp_path / "made", bag="A"), "shards/00000")
        assert len(list(faults_of(store, {"files": [row]}))) == 1  # type: ignore[typeddict-item]
    monkeypatch.setenv("AWS_ENDPOINT_URL_S3", "http://127.0.0.1:9")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    forget_clients()
    with pytest.raises(StoreError, match=r"checked/shards/00000/bag\.mcap: Could not connect") as raised:
        list(faults_of(store, {"files": [row]}))  # type: ignore[typeddict-item]
    assert "\n" not in str(raised.value)
    forget_clients()
