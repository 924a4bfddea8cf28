"""What a run senses beside its camera's frames, at rates of its own: laser scanner, body, inertial measurement unit, wheels, lidar."""

from typing import Any, NamedTuple, Protocol

from renderer.body.config import NO_BODY, NO_IMU, NO_WHEELS, BodyConfig, ImuConfig, WheelsConfig
from renderer.lidar.config import NO_SCAN, ScanConfig
from renderer.lidar.sweep_config import NO_LIDAR, LidarConfig
from scene_description.strict import FieldError


class Senses(NamedTuple):
    """The settings of all of them; each says whether it is enabled."""

    scan: ScanConfig = NO_SCAN
    body: BodyConfig = NO_BODY
    imu: ImuConfig = NO_IMU
    wheels: WheelsConfig = NO_WHEELS
    lidar: LidarConfig = NO_LIDAR

    @property
    def tells_body(self) -> bool:
        """Whether the body is published here."""
        return self.body.enabled and self.body.publish

    @property
    def clock_rate_hz(self) -> float:
        """Rate of ``/clock`` where the body is published: as asked for, else that of the fastest stream."""
        rates = [self.body.rate_hz, *(sense.rate_hz for sense in (self.imu, self.wheels, self.lidar) if sense.enabled)]
        return self.body.clock_rate_hz or max(rates)

    def check(self) -> None:
        """Refuse what does not go together.

        Raises:
            FieldError: a sensor of a body that is not published.
        """
        for name in ("imu", "wheels", "lidar"):
            if getattr(self, name).enabled and not self.tells_body:
                raise FieldError(f"{name}.enabled", "body.enabled and body.publish with it", "neither" if not self.body.enabled else "one")


NO_SENSES = Senses()


class Settings(Protocol):
    """Parameters by prefix."""

    def __getitem__(self, prefix: str, /) -> Any:
        """Return the dataclass of a prefix."""


def senses_of(groups: Settings) -> Senses:
    """Return what a renderer senses by its parameters, prefix -> dataclass."""
    return Senses(*(groups[name] for name in Senses._fields))
