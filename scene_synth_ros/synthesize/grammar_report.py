"""What the grammar node says of itself on ``/diagnostics``."""

from __future__ import annotations

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from scene_description.strict import shorten
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Report
from scene_synth_ros.synthesize.room_job import Prepared
from scene_synth_ros.synthesize.run import Run
from scene_synth_ros.synthesize.run_config import RunConfig

_NO_COST = SamplingCost(attempts=0, proposals=0, chain_s=0.0)


def grammar_report(
    run: Run, config: RunConfig, request: SceneRequest, room: Prepared | None, obstacle: str, warning: str, now_s: float
) -> Report:
    """Return level, message and values.

    Args:
        run: where it stands.
        config: of the run.
        request: what rooms are asked for.
        room: that was sent last.
        obstacle: why no room can be made now, or nothing.
        warning: the newest one, or nothing.
        now_s: time of the run's clock.
    """
    cost = room.cost if room is not None else _NO_COST
    values = {
        "seed": config.seed,
        "room_type": request.room_type,
        "rooms_sent": run.next_index - config.first_index,
        "rate_hz": config.rate_hz,
        "lock_step": config.lock_step,
        "seconds_per_room": f"{room.seconds if room is not None else 0.0:.3f}",
        "layouts_per_room": cost.attempts,
        "proposals_per_room": cost.proposals,
        "proposals_per_second": f"{cost.proposals / cost.chain_s:.3g}" if cost.chain_s else "0",
        "waiting_for": "resume" if run.paused else run.waiting,
        "peers": ", ".join(f"{peer.node} {peer.state} {peer.done_scene}" for peer in run.peers),
        "last_complaint": warning,
    }
    if obstacle:
        return ERROR, shorten(obstacle) if len(obstacle) > 500 else obstacle, values
    waited = now_s - run.last_sent_s
    if run.waiting and waited > config.peer_timeout_s:
        return WARN, f"waiting since {waited:.0f} s for {run.waiting}", values
    return (WARN, warning, values) if warning else (OK, "synthesising rooms", values)
