"""The run: which room goes out next and when, what it waits for, and when it is over.  No ROS, no clocks, no threads.

A run in lock-step can be held between two frames, let go by so many, and stopped: it has begun again then, and its first room waits.

In lock-step a room goes out when the expected peers are ready and have finished the rooms before it, but for ``rooms_ahead``.
Free-running, it goes out when the frames of the one before have had their time by the wall clock, which begins, where time is simulated,
when all renderers have the first of them.  Simulated time counts frames and never
goes back; stamps by the wall clock are given to a room when it goes out.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from grammar.synthesize import CameraTimes
from scene_description import CameraPose
from scene_synth_ros.suite.status import NodeStatus, begun_in_run, done_in_run
from scene_synth_ros.synthesize.run_config import RunConfig

ROOM_CHANGE_S = 0.3
"""By the wall clock, the first frame of a room is due so long after the room has gone out: a renderer prepares it meanwhile."""


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """Times of a sequence of frames from ``origin_ns`` on, ``rate_hz`` a second, counted from frame ``first_frame``.

    A change of rate while running starts a new sequence at the next frame's time, so stamps always increase.
    """

    origin_ns: int
    rate_hz: float
    first_frame: int = 0

    def stamp_ns(self, frame: int) -> int:
        """Return the stamp of a frame, frame >= first_frame."""
        return self.origin_ns + round((frame - self.first_frame) * 1_000_000_000 / self.rate_hz)

    def at_rate(self, rate_hz: float, frame: int) -> "FrameTimes":
        """Return the times from ``frame`` on at another rate."""
        return FrameTimes(self.stamp_ns(frame), rate_hz, frame)


def moved_to(path: Sequence[CameraPose], start_ns: int) -> tuple[CameraPose, ...]:
    """Return a camera path whose first frame has the stamp ``start_ns``; the times between frames stay."""
    return tuple(replace(pose, stamp_ns=pose.stamp_ns - path[0].stamp_ns + start_ns) for pose in path)


def waiting_for(peers: Mapping[str, NodeStatus], expected: Mapping[str, int], last_sent: int, run: str) -> str:
    """Return what the next room must wait for, in words; empty if it may go out.

    Args:
        peers: newest status by node name.
        expected: role -> how many of them the run has.
        last_sent: index of the room that must be finished by all, -1 for none.
        run: name of the run, of which every peer must have heard.
    """
    for role, count in expected.items():
        present = [peer for peer in peers.values() if peer.role == role and peer.state == "ready"]
        if len(present) < count:
            return f"{count - len(present)} of {count} {role}s to be ready"
        unaware = sorted(peer.node for peer in present if peer.run != run)
        if unaware:
            return f"{', '.join(unaware)} to hear of the run"
        late = sorted(peer.node for peer in present if done_in_run(peer, run) < last_sent)
        if late:
            return f"{', '.join(late)} to finish room {last_sent}"
    return ""


def finished_by_all(peers: Mapping[str, NodeStatus], run: str) -> int:
    """Return the index of the last room of a run that every renderer and recorder has finished or refused, -1 if there is none."""
    return min((done_in_run(peer, run) for peer in peers.values()), default=-1)


def missing_peers(peers: Mapping[str, NodeStatus], present: Collection[str], absences: dict[str, int], patience: int) -> list[str]:
    """Return the peers that were once among the publishers of ``status`` but not for the last ``patience`` looks.

    Args:
        peers: newest status by node name.
        present: fully qualified names of the nodes that publish ``status`` now.
        absences: looks in a row that each peer was missing; brought up to date.
        patience: discovery may be slower than the first status, and nodes start again.
    """
    for name in [name for name in absences if name not in peers]:
        del absences[name]
    for name in peers:
        if name in present or name in absences:
            absences[name] = 0 if name in present else absences[name] + 1
    return sorted(name for name, count in absences.items() if count >= patience)


def peer_failures(peers: Mapping[str, NodeStatus], last_sent: int, run: str) -> list[str]:
    """Return what has gone wrong at the peers, one line each: those that have failed, and those that refused the run's room sent last."""
    lines = []
    for name in sorted(peers):
        if peers[name].state == "failed":
            lines.append(f"{name} failed: {peers[name].reason}")
        elif 0 <= last_sent == peers[name].refused_scene and peers[name].run == run:
            lines.append(f"{name} refused room {last_sent}: {peers[name].reason}")
    return lines


_PATIENCE = 3
_BEGIN_PATIENCE_S = 30.0
"""A free run waits no longer for the first frame of a room."""
_FAULT_PAUSE_S = 1.0
"""How long the run waits after a room that a fault of the program has cost, so that a fault in every room does not fill the log."""


def waiting_line(waited_s: float, waiting: str) -> str:
    """Return one line that says since when, and for what, the next room waits."""
    return f"waiting since {waited_s:.0f} s for {waiting}"


class Step(Enum):
    """What the grammar node shall do now."""

    WAIT = "wait"
    SEND = "send"
    BEGIN_AGAIN = "begin again"
    FINISH = "finish"


@dataclass(frozen=True, slots=True)
class Order:
    """A room to synthesise: its index, the times of its frames, and the generation of the settings that it is for."""

    index: int
    times: CameraTimes
    generation: int


def times_of_room(config: RunConfig, index: int) -> CameraTimes:
    """Return the times of a room's frames in a run that goes through, from its first room on, without a change of its settings."""
    start_ns = round(config.start_time_s * 1e9)
    first = index * config.frames_per_room
    return CameraTimes(frames=config.frames_per_room, start_ns=start_ns, rate_hz=config.rate_hz, first_index=first)


class RoomSchedule:
    """Which room of a run goes out next and when, what it waits for, and when the run is over.

    Times are those of one steady clock, in seconds.

    Args:
        origin: whatever tells this run from those of others and of before; at most 48 characters.

    Attributes:
        next_index: index of the next room.
        last_sent: index of the room sent last, -1 for none.
        last_sent_s: when that was; at first, when the run began.
        generation: changes whenever rooms prepared before are of no use.
        waiting: what the next room waits for, in words; empty if nothing.
        finished_by_all: index of the last room that all peers have finished, -1 for none.
        stopped: whether the first room waits for :meth:`play` or :meth:`hold`.
    """

    def __init__(self, config: RunConfig, now_s: float, origin: str = "") -> None:
        self._config = config
        self._origin, self._beginnings = origin, 0
        self._times = FrameTimes(round(config.start_time_s * 1e9), config.rate_hz)
        self.next_index, self._next_frame = config.first_index, config.first_index * config.frames_per_room
        self.last_sent, self.last_sent_s = -1, now_s
        self._send_s = self._prepare_s = 0.0
        self._begins = False
        self.generation, self.waiting, self.finished_by_all = 0, "", -1
        self._peers: dict[str, NodeStatus] = {}
        self._absences: dict[str, int] = {}
        self._paused_s: float | None = None
        self._told_waiting = ""
        self._reset_asked = self._one_more = self._finished = False
        self._held, self._until_ns = False, 0
        self._restarts_time = self._leaves_room = False
        self.stopped = config.start_stopped

    @property
    def name(self) -> str:
        """The run's name, a new one whenever it begins again.

        In lock-step the first room waits until every peer has repeated it, so that nothing said of a room before a reset is taken for the
        room of the same index after it.
        """
        return f"{self._origin}.{self._beginnings}"

    @property
    def peers(self) -> Collection[NodeStatus]:
        """The newest status of each renderer and recorder."""
        return self._peers.values()

    @property
    def paused(self) -> bool:
        """Whether no rooms go out because a pause was asked for."""
        return self._paused_s is not None

    @property
    def held(self) -> bool:
        """Whether no frames go out but those that were let out one by one."""
        return self._held

    @property
    def is_reset(self) -> bool:
        """Whether no reset is on its way."""
        return not self._reset_asked

    @property
    def is_over(self) -> bool:
        """Whether all rooms are done."""
        return self._finished

    @property
    def shown_ns(self) -> int:
        """Stamp of the last frame of this run that a renderer has told of, -1 for none."""
        return max((peer.shown_ns for peer in self._renderers()), default=-1)

    @property
    def until_ns(self) -> int:
        """Stamp of the last frame that may go out, -1 for no limit; a room that a reset waits for goes on to its end."""
        finishes = self._reset_asked and not self._leaves_room
        return max(self._until_ns, self.shown_ns) if self._held and not finishes else -1

    def _renderers(self) -> list[NodeStatus]:
        return [peer for peer in self._peers.values() if peer.role == "renderer" and peer.run == self.name]

    @property
    def is_complete(self) -> bool:
        """Whether the last room has gone out."""
        return self._last_index is not None and self.next_index > self._last_index

    @property
    def _last_index(self) -> int | None:
        return self._config.first_index + self._config.rooms - 1 if self._config.rooms else None

    def change(self, config: RunConfig) -> None:
        """Take new settings; what is prepared is made again, and stamps go on at the new rate from the next frame on."""
        if config.rate_hz != self._times.rate_hz:
            self._times = self._times.at_rate(config.rate_hz, self._next_frame)
        self._config = config
        self.generation += 1

    def take_status(self, status: NodeStatus) -> bool:
        """Take the status of a renderer or recorder; return whether all have now finished another room."""
        self._peers[status.node] = status
        before, self.finished_by_all = self.finished_by_all, finished_by_all(self._peers, self.name)
        return before != self.finished_by_all

    def drop_missing(self, present: Collection[str]) -> list[str]:
        """Forget the peers that have been missing from the nodes present for some looks in a row; return their names."""
        missing = missing_peers(self._peers, present, self._absences, _PATIENCE)
        for name in missing:
            del self._peers[name]
        return missing

    def peer_failures(self) -> list[str]:
        """Return what has gone wrong at the peers, one line each."""
        return peer_failures(self._peers, self.last_sent, self.name)

    def long_wait(self, now_s: float) -> str:
        """Return, once for everything that is waited for, a line that says so after ``peer_timeout_s``; empty if there is no news."""
        waited_s = now_s - self.last_sent_s
        if not self.waiting or waited_s <= self._config.peer_timeout_s or self.waiting == self._told_waiting:
            return ""
        self._told_waiting = self.waiting
        return waiting_line(waited_s, self.waiting)

    def ask_for_one(self) -> str:
        """Let the next room out at once, paused or not; return what it must wait for all the same, in words."""
        self._one_more, self._send_s = True, 0.0
        return self.waiting

    def ask_for_reset(self) -> str:
        """Let the run begin again with its first room; return what that must wait for, in words."""
        self._reset_asked = True
        return self._waits_for(self.last_sent)

    def play(self, now_s: float) -> None:
        """Let rooms and frames go on; playing, harmless."""
        self.stopped = self._held = False
        self.resume(now_s)

    def hold(self) -> None:
        """Let no more frames out; once held, harmless.  A run that was stopped sends its first room."""
        if not self._held or self.stopped:
            self._until_ns = 0
        self.stopped, self._held = False, True

    def let_out(self, frames: int, path: Sequence[int]) -> int:
        """Let so many more frames of a held run out; return the stamp of the last of them.

        Args:
            frames: how many, at least 1.
            path: stamps of the frames of the room that was sent last.
        """
        left = [stamp_ns for stamp_ns in path if stamp_ns > self.shown_ns]
        later = self._next_frame + frames - len(left) - 1
        self._until_ns = left[frames - 1] if frames <= len(left) else self._times.stamp_ns(later)
        return self._until_ns

    def has_shown(self, until_ns: int) -> bool:
        """Return whether all renderers of the run have published the frames up to a stamp."""
        renderers = self._renderers()
        expected = max(self._config.expected_renderers, 1)
        return len(renderers) >= expected and all(peer.shown_ns >= until_ns for peer in renderers)

    def begin_anew(self, *, time: bool, stopped: bool) -> None:
        """Let the run begin again, and stop it, or keep it held or going.

        The room at work is left where nobody records, else it is finished first.  ``time``: simulated time begins again as well.
        """
        self.stopped = stopped
        self._reset_asked, self._restarts_time = True, time
        self._leaves_room = not self._config.expected_recorders

    def _reset_waits_for(self) -> str:
        """Return, in words, what a reset must wait for."""
        return "" if self._leaves_room else self._waits_for(self.last_sent)

    def pause(self, now_s: float) -> None:
        """Let no more rooms out; once paused, harmless."""
        if self._paused_s is None:
            self._paused_s = now_s

    def resume(self, now_s: float) -> None:
        """Let rooms out again; free-running, simulated time has gone on since the last room ended."""
        if self._paused_s is None:
            return
        idle_s = now_s - max(self._paused_s, self._send_s)
        if not self._config.lock_step and self.last_sent >= 0 and idle_s > 0.0:
            self._next_frame += math.ceil(idle_s * self._config.rate_hz) + 1
            self.generation += 1
        self._paused_s = None

    def step(self, now_s: float, active: bool) -> Step:
        """Return what to do now; ``active``: whether the node may send rooms at all."""
        if self._reset_asked and not self._reset_waits_for():
            self._begin_again()
            return Step.BEGIN_AGAIN
        ahead = 0 if self.is_complete else self._config.rooms_ahead - 1
        self.waiting = self._waits_for(self.last_sent - ahead) or self._waits_for_beginning(now_s)
        if self.is_complete:
            if self.waiting or self._finished or not (self._config.lock_step or self._last_room_is_over(now_s)):
                return Step.WAIT
            self._finished = True
            return Step.FINISH
        held = self._reset_asked or self.stopped or not active or (self.paused and not self._one_more)
        return Step.WAIT if held or self.waiting or now_s < self._send_s else Step.SEND

    def order(self, now_s: float) -> Order | None:
        """Return the room to prepare; None if none is left, or none yet after a fault."""
        if self.is_complete or now_s < self._prepare_s:
            return None
        times = CameraTimes(
            frames=self._config.frames_per_room,
            start_ns=self._times.origin_ns,
            rate_hz=self._times.rate_hz,
            first_index=self._next_frame - self._times.first_frame,
        )
        return Order(self.next_index, times, self.generation)

    def sent(self, frames: int, now_s: float) -> None:
        """Count the next room as sent, with so many frames."""
        self.last_sent, self.last_sent_s = self.next_index, now_s
        change_s = ROOM_CHANGE_S if self._config.clock == "wall" else 0.0
        self._send_s = 0.0 if self._config.lock_step else now_s + change_s + frames / self._config.rate_hz
        self._begins = not self._config.lock_step and self._config.clock == "simulated"
        self._one_more, self._told_waiting = False, ""
        self.next_index += 1
        self._next_frame += frames

    def skip(self, now_s: float) -> None:
        """Go on without the next room, which a fault of the program has cost; its index and its time stay empty."""
        self.next_index += 1
        self._next_frame += self._config.frames_per_room
        self._prepare_s = now_s + _FAULT_PAUSE_S

    def _waits_for_beginning(self, now_s: float) -> str:
        """Return, in words, which renderers a free run's room has not begun at; its end moves by as much as the last of them takes."""
        if not self._begins:
            return ""
        ready = [peer for peer in self._renderers() if peer.state == "ready"]
        late = sorted(peer.node for peer in ready if begun_in_run(peer, self.name) < self.last_sent)
        if late and now_s - self.last_sent_s < _BEGIN_PATIENCE_S:
            return f"{', '.join(late)} to begin room {self.last_sent}"
        self._begins = False
        if not late and any(done_in_run(peer, self.name) < self.last_sent for peer in ready):
            self._send_s += now_s - self.last_sent_s
        return ""

    def _begin_again(self) -> None:
        """Go back to the first room; what peers say of rooms before counts no more."""
        first = self._config.first_index
        self.next_index, self.last_sent, self.finished_by_all = first, -1, -1
        self._beginnings += 1
        self.generation += 1
        if self._restarts_time:
            self._times = FrameTimes(round(self._config.start_time_s * 1e9), self._config.rate_hz)
            self._next_frame = first * self._config.frames_per_room
        self._reset_asked = self._finished = self._restarts_time = self._leaves_room = False
        self._send_s, self._until_ns = 0.0, 0

    def _waits_for(self, must_be_done: int) -> str:
        """Return, in words, what must be waited for until all peers have finished a room (none, if it is not of this run)."""
        config = self._config
        expected = {"renderer": config.expected_renderers, "recorder": config.expected_recorders}
        must_be_done = must_be_done if must_be_done >= config.first_index else -1
        return waiting_for(self._peers, expected, must_be_done, self.name) if config.lock_step else ""

    def _last_room_is_over(self, now_s: float) -> bool:
        """Return whether a free-running run is over: its last room's time is up, and whoever is there has finished it."""
        there = [peer for peer in self._peers.values() if peer.state == "ready"]
        return now_s >= self._send_s and all(done_in_run(peer, self.name) >= self.last_sent for peer in there)
