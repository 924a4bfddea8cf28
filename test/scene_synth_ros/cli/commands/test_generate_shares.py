"""``scene_synth generate`` in shares that know nothing of each other, into an object store."""

from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest
from s3_server import BUCKET, s3_server

from scene_synth_ros.bags.dataset_files import DATASET_MANIFEST_NAME, PLAN_NAME
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands.generate_command import Share, read_share
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.shards.completion import survey
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import read_plan
from scene_synth_ros.shards.run_shards import finish_dataset
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.shards.url_store import UrlStore

pytestmark = pytest.mark.slow

WORDS = ["--rooms", "2", "--frames", "1", "--seed", "3", "--shard-rooms", "1", "--params", "ground_truth", "--workers", "1"]
WORDS += ["-p", "renderer_node.camera.width:=48", "-p", "renderer_node.camera.height:=36"]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with s3_server():
        yield f"s3://{BUCKET}/dataset"


def generate(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["generate", *words])
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_the_last_share_writes_the_manifest_that_a_single_run_writes(url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = UrlStore(url)
    assert generate(*WORDS, "--out", url, "--shard", "1/2") == 0
    assert "this share is complete; 1 of 2 shards are missing, 0 the first" in capsys.readouterr().out
    assert store.names("") == [PLAN_NAME, "shards"]
    assert generate("--out", url, "--finish") == 2
    assert "1 of 2 shards are missing" in capsys.readouterr().err

    # an upload that was interrupted: an object, half of another, no completion file
    files = fsspec.filesystem("s3")
    files.pipe_file(f"{url}/shards/00000/metadata.yaml", b"half")
    files.call_s3("create_multipart_upload", Bucket=BUCKET, Key="dataset/shards/00000/00000_0.mcap")
    assert generate(*WORDS, "--out", url, "--shard", "0/2") == 0
    told = capsys.readouterr().out
    assert "removed what an interrupted run has left of 2 shards" in told
    assert f"{url}: 2 rooms, 2 frames" in told
    assert files.list_multipart_uploads(BUCKET) == []

    data = store.read(PLAN_NAME)
    assert data
    plan, alone = read_plan(data, PLAN_NAME), LocalStore(tmp_path)
    for shard in (0, 1):
        make_shard(plan, shard, alone)
    finish_dataset(plan, alone, survey(plan, alone))
    assert store.read(DATASET_MANIFEST_NAME) == alone.read(DATASET_MANIFEST_NAME)
    for name in ("00000/00000_0.mcap", "00001/metadata.yaml"):
        assert store.read(f"shards/{name}") == alone.read(f"shards/{name}")
    assert b"# Dataset of synthetic rooms" in (store.read("README.md") or b"")
    assert "layouts.jpg" in store.names("card")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--rooms", "3", "--finish"], "--finish: expected neither"),
        (["--finish"], "holds no dataset"),
        (["--shard", "0/2"], "holds no dataset"),
        (["--rooms", "3", "--out", "s3://"], "s3://: expected a bucket and a folder, s3://bucket/folder, got no bucket"),
        (["--rooms", "3", "--out", "s3:///rooms"], "s3:///rooms: expected a bucket"),
        (["--rooms", "3", "--shard", "2/2"], "--shard 2/2: expected I/N"),
        (["--rooms", "3", "--ray", "--shard", "0/2"], "not allowed with argument"),
    ],
)
def test_options_that_contradict_each_other_are_refused(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert generate("--out", str(tmp_path / "rooms"), *words) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "rooms").exists()


@pytest.mark.parametrize("text", ["2/2", "0/0", "1", "a/b", "-1/2", "1/2/3"])
def test_a_share_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected I/N"):
        read_share(text)


def test_shares_are_disjoint_and_all_there_is() -> None:
    class Plan:
        shards = 11

    shares = [list(Share(index, 3).shards(Plan())) for index in range(3)]  # type: ignore[arg-type]
    assert shares[1] == [1, 4, 7, 10]
    assert sorted(shard for share in shares for shard in share) == list(range(11))
    assert read_share("2/3") == Share(2, 3)
