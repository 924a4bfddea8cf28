"""Layouts: fields lie one after another, with their stride, and none twice."""

from renderer.core import lanes as ln
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES
from renderer.path import queues as qu
from renderer.path.queues import ROW


def test_fields_lie_one_after_another() -> None:
    layout = Layout(16)
    assert [layout.field(), layout.field(3), *layout.vector(), layout.size] == [0, 16, 64, 80, 96, 112]
    assert Layout().vector() == (0, 1, 2)


def test_no_two_fields_of_the_lanes_share_a_place() -> None:
    places = [value for name, value in vars(ln).items() if name.isupper() and name not in ("LANES", "CARRIED", "LANES_SIZE", "_LANES")]
    assert sorted(places) == list(range(0, ln.LANES_SIZE, LANES))


def test_the_first_fields_of_queue_and_lanes_are_the_same() -> None:
    """They are copied by number: ``CARRIED`` of them."""
    names = {value // LANES: name for name, value in vars(ln).items() if name.isupper() and isinstance(value, int)}
    for place in range(1, ln.CARRIED):
        assert getattr(qu, names[place]) == place * ROW
    assert ln.BETA_R == qu.BETA_R == 0
