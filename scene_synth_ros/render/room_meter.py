"""The exposure of a room's frames: fixed, or metered once when the room's colour is first wanted."""

from __future__ import annotations

from collections.abc import Callable

from renderer import RenderConfig
from renderer.exposure import exposed, needs_meter, sensor_ev100
from renderer.film.tone import Exposure
from scene_synth_ros.suite.parameters import Parameters


class RoomMeter:
    """Meters the room at work.

    Threading: :meth:`begin_room` and :meth:`exposure` belong to the rendering thread; :meth:`known_exposure` may be asked by any: what it
    reads is replaced as a whole.

    Args:
        settings: ``camera``, ``sensor`` and ``render``; changes of the exposure take effect with the next frame.
    """

    def __init__(self, settings: Parameters) -> None:
        self._settings = settings
        self._room: tuple[RenderConfig, Callable[[], Exposure]] | None = None
        self._metered: Exposure | None = None

    def begin_room(self, render: RenderConfig, meter: Callable[[], Exposure]) -> None:
        """Take a new room, which is not metered yet; ``meter`` does it, or returns what it has found before."""
        self._room, self._metered = (render, meter), None

    def exposure(self, color_wanted: bool) -> Exposure:
        """Return the exposure of the next frame.

        The room is metered when colour is first wanted: never while who wants it may not be connected yet.
        """
        if self._metered is None and color_wanted and self._room is not None and needs_meter(self._room[0]):
            self._metered = self._room[1]()
        return self.known_exposure()

    def known_exposure(self) -> Exposure:
        """Return the exposure as far as it is known: that of a frame without colour, until the room is metered."""
        fixed = sensor_ev100(self._settings["camera"], self._settings["sensor"])
        return exposed(self._settings["render"], self._metered, fixed)
