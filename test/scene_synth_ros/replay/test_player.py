"""What the player hands out and when, on a clock that only moves while the player waits."""

import threading
from types import SimpleNamespace

import pytest
from bag_samples import LATCHED, PERIOD_NS, START_NS, TOPICS, frame_messages, text, write_bag

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.replay import player as player_module
from scene_synth_ros.replay.player import Player


class Clock:
    """Stands in for the monotonic clock; waiting moves it."""

    def __init__(self, monkeypatch):
        self.now_ns = 5_000
        clock = self
        monkeypatch.setattr(player_module.time, "monotonic_ns", lambda: clock.now_ns)

        class Waiting(threading.Condition().__class__):
            def wait(self, timeout=None):
                assert timeout is not None and timeout > 0
                clock.now_ns += round(timeout * 1e9)
                return False

        monkeypatch.setattr(player_module, "threading", SimpleNamespace(**{**vars(threading), "Condition": Waiting}))


@pytest.fixture
def bag(tmp_path):
    return tmp_path / "bag", write_bag(tmp_path / "bag", frames=8, chunk_size=4000)


def play(folder, clock=None, on_message=None, topics=TOPICS, **options):
    played = []

    def publish(message):
        played.append((message.topic, message.log_ns, message.data, clock.now_ns if clock else None))
        if on_message:
            on_message(player, message)

    with BagReader(folder) as reader:
        player = Player(reader, publish, topics=topics, **options)
        player.run()
    assert player.published == len(played)
    return played


@pytest.mark.parametrize("rate", [1.0, 0.25, 40.0])
def test_every_message_at_its_time(bag, monkeypatch, rate):
    folder, written = bag
    clock = Clock(monkeypatch)
    played = play(folder, clock, rate=rate)
    assert [message[:3] for message in played] == written
    for _, log_ns, _, at_ns in played:
        assert abs(at_ns - 5_000 - (log_ns - START_NS) / rate) <= 8


def test_a_slow_publisher_is_caught_up_with_and_nothing_is_left_out(bag, monkeypatch):
    folder, written = bag
    clock = Clock(monkeypatch)

    def stall(_player, message):
        if message.log_ns == START_NS + 2 * PERIOD_NS and message.topic.endswith("depth/image_raw"):
            clock.now_ns += 3 * PERIOD_NS

    played = play(folder, clock, stall)
    assert len(played) == len(written)
    late = {(log_ns - START_NS) // PERIOD_NS: at_ns - 5_000 - (log_ns - START_NS) for _, log_ns, _, at_ns in played}
    assert [late[i] // PERIOD_NS for i in range(8)] == [0, 0, 3, 2, 1, 0, 0, 0]


def test_what_follows_a_long_stall_keeps_its_rhythm(bag, monkeypatch):
    folder, written = bag
    clock = Clock(monkeypatch)

    def stall(_player, message):
        if message.log_ns == START_NS + 2 * PERIOD_NS and message.topic.endswith("depth/image_raw"):
            clock.now_ns += 30 * PERIOD_NS

    played = play(folder, clock, stall)
    assert len(played) == len(written)
    late = {(log_ns - START_NS) // PERIOD_NS: at_ns - 5_000 - (log_ns - START_NS) for _, log_ns, _, at_ns in played}
    assert [late[i] // PERIOD_NS for i in range(6)] == [0, 0, 30, 30, 30, 30]


def test_rate_and_pause_change_while_playing(bag, monkeypatch):
    folder, _ = bag
    clock = Clock(monkeypatch)

    def change(player, message):
        if message.log_ns == START_NS + 2 * PERIOD_NS and message.topic.endswith("color/image_raw"):
            player.set_rate(2.0)
        if message.log_ns == START_NS + 4 * PERIOD_NS and message.topic.endswith("color/image_raw"):
            player.pause()
            clock.now_ns += 50 * PERIOD_NS
            player.resume()

    played = play(folder, clock, change)
    times = {(log_ns - START_NS) // PERIOD_NS: (at_ns - 5_000) / PERIOD_NS for _, log_ns, _, at_ns in played}
    assert [round(times[i], 3) for i in range(8)] == [0, 1, 2, 2.5, 53, 53.5, 54, 54.5]


def test_start_offset_brings_the_latched_state_first(tmp_path, monkeypatch):
    clock = Clock(monkeypatch)
    with BagWriter(tmp_path / "bag") as writer:
        for topic, (type_name, qos) in {**TOPICS, "/deep": ("std_msgs/msg/String", LATCHED)}.items():
            writer.add_topic(topic, type_name, [qos])
        for index in range(6):
            stamp_ns = START_NS + index * PERIOD_NS
            for topic, _, data in frame_messages(index):
                writer.write(topic, data, stamp_ns, stamp_ns)
            writer.write("/synth/scene", text(index), stamp_ns, stamp_ns)
    played = play(tmp_path / "bag", clock, start_offset_ns=3 * PERIOD_NS)
    state, rest = played[:3], played[3:]
    assert {topic for topic, _, _, _ in state} == {"/synth/scene", "/tf_static", "/synth/camera/semantic/labels"}
    assert next(data for topic, _, data, _ in state if topic == "/synth/scene") == text(2)
    assert {at_ns for _, _, _, at_ns in state} == {5_000}
    assert min(log_ns for _, log_ns, _, _ in rest) == START_NS + 3 * PERIOD_NS and rest[0][3] == 5_000
    assert len(rest) == 3 * 5


def test_topics_are_chosen(bag, monkeypatch):
    folder, _ = bag
    played = play(folder, Clock(monkeypatch), topics=["/tf_static", "/synth/camera/color/image_raw"])
    assert [message[0] for message in played] == ["/tf_static"] + ["/synth/camera/color/image_raw"] * 8


def test_loop_begins_again_until_it_is_switched_off(bag, monkeypatch):
    folder, written = bag
    clock = Clock(monkeypatch)
    seen = []

    def count(player, message):
        seen.append(message)
        if len(seen) == 2 * len(written) + 1:
            player.set_loop(False)

    played = play(folder, clock, count, loop=True)
    assert [message[:3] for message in played] == written * 3
    assert played[-1][3] - 5_000 == 3 * 7 * PERIOD_NS


def test_a_loop_over_nothing_ends(bag):
    assert play(bag[0], topics=[], loop=True) == []


def test_pause_holds_and_stop_ends_a_player_that_waits(bag):
    folder, written = bag
    played = []
    with BagReader(folder) as reader:
        player = Player(reader, played.append, topics=TOPICS, rate=1000.0, paused=True)
        thread = threading.Thread(target=player.run)
        thread.start()
        player.set_rate(500.0)
        assert player.paused and played == [] and player.position_s() == 0.0
        player.resume()
        thread.join(timeout=10)
        assert not thread.is_alive() and len(played) == len(written)
        stuck = Player(reader, played.append, topics=TOPICS, paused=True)
        thread = threading.Thread(target=stuck.run)
        thread.start()
        stuck.stop()
        thread.join(timeout=10)
        assert not thread.is_alive() and stuck.published == 0


class Run:
    """A player in a thread of its own, and what it has handed out."""

    def __init__(self, folder, **options):
        self.played = []
        self.reader = BagReader(folder)
        self.player = Player(self.reader, self.played.append, topics=TOPICS, **options)
        self.thread = threading.Thread(target=self.player.run, daemon=True)
        self.thread.start()

    def wait_for(self, count):
        for _ in range(1000):
            if len(self.played) >= count:
                break
            threading.Event().wait(0.01)
        threading.Event().wait(0.1)
        return [(message.topic, message.log_ns, message.data) for message in self.played]

    def end(self):
        self.player.stop()
        self.thread.join(10)
        self.reader.close()
        assert not self.thread.is_alive()


def test_a_step_hands_out_one_frame(bag):
    folder, written = bag
    run = Run(folder, paused=True)
    assert run.wait_for(0) == []
    total = 0
    for frame in range(3):
        run.player.step()
        total += len(frame_messages(frame))
        assert run.wait_for(total) == written[:total]
        assert run.player.position_s() == pytest.approx(frame * PERIOD_NS * 1e-9)
    run.end()


def test_a_seek_goes_on_with_the_latched_state_of_that_time(bag):
    folder, written = bag
    run = Run(folder, paused=True)
    run.player.step()
    seen = len(run.wait_for(len(frame_messages(0))))
    assert run.player.seek(5 * PERIOD_NS * 1e-9) == pytest.approx(5 * PERIOD_NS * 1e-9)
    latched = [message for message in written if TOPICS[message[0]][1] is LATCHED]
    assert sorted(run.wait_for(seen + len(latched))[seen:]) == sorted(latched)
    run.player.step()
    expected = frame_messages(5)
    assert run.wait_for(seen + len(latched) + len(expected))[seen + len(latched) :] == expected
    assert run.player.seek(-3.0) == 0.0
    run.player.step()
    run.wait_for(seen + len(latched) + len(expected) + seen)
    assert [m.log_ns for m in run.played[-seen:]] == [START_NS] * seen
    assert run.player.seek(1e9) == pytest.approx(7 * PERIOD_NS * 1e-9)
    run.end()


def test_it_can_be_sought_after_a_paused_end(bag):
    folder, written = bag
    run = Run(folder, rate=1000.0, paused=True)
    for _ in range(8):
        run.player.step()
    before = len(run.wait_for(len(written)))
    assert before == len(written) and run.thread.is_alive()
    run.player.seek(7 * PERIOD_NS * 1e-9)
    run.player.resume()
    run.thread.join(10)
    assert not run.thread.is_alive()
    assert {m.log_ns for m in run.played[before:] if "image" in m.topic} == {START_NS + 7 * PERIOD_NS}
    run.reader.close()


def test_time_begins_with_the_first_message(bag, monkeypatch):
    folder, _ = bag
    clock = Clock(monkeypatch)
    times = []
    with BagReader(folder) as reader:
        player = Player(reader, lambda _: times.append((player.has_begun, player.log_time_ns())), topics=TOPICS)
        for change in (lambda: None, lambda: player.set_rate(2.0), player.pause, player.resume, lambda: player.seek(0.0)):
            change()
            clock.now_ns += 3 * 10**9  # it waits for subscribers
            assert not player.has_begun and player.log_time_ns() == START_NS
        player.run()
    assert all(begun for begun, _ in times[1:]) and times[0][1] == START_NS
    assert [now for _, now in times] == sorted(now for _, now in times)
