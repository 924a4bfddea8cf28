"""The page in a real browser: it shows the frames of the bag, tells the numbers under the pointer, and obeys keys; nothing else happens.

``make test`` runs this where a Chromium is installed (``apt install chromium``).
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from chromium import Page
from needed_tools import need
from room_bag import RoomBag, write, write_room_bag

from renderer.camera.cameras import intrinsics
from renderer.film.false_color import depth_to_color, objects_to_color
from scene_description.labels import NYU40
from scene_description.poses import world_from_optical
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.page.page_file import write_page
from scene_synth_ros.messages.conversions import image_to_msg

pytestmark = pytest.mark.browser
SHIFT = 8
EVIL = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>"


class Shown(NamedTuple):
    """A page of a bag, and the bag."""

    page: Path
    bag: RoomBag


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    need("chromium")
    with Page(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Shown:
    folder = tmp_path_factory.mktemp("shown")
    bag = write_room_bag(folder / "bag")
    write_page(bag.path, folder / "page.html", rooms=8, frames=8, max_size=640)
    return Shown(folder / "page.html", bag)


@pytest.fixture(autouse=True)
def no_complaints(browser: Page) -> Iterator[None]:
    """Whatever a test does, the page raises nothing, the browser complains of nothing, and nothing is loaded."""
    browser.events.clear()
    yield
    assert browser.complaints() == [] and "error" not in browser.state()


def near(text: str, expected: np.ndarray, margin: float) -> bool:
    values = [float(word.replace("−", "-")) for word in text.split()]
    return bool(np.abs(np.array(values) - expected).max() <= margin)


def canvas_pixel(browser: Page, layer: str, x: int, y: int) -> list[int]:
    """Return red, green and blue of what is painted of a layer."""
    code = f"""(() => {{
        const copy = new OffscreenCanvas(1, 1).getContext('2d', {{ willReadFrequently: true }});
        copy.drawImage(document.querySelector('canvas[aria-label^="{layer}:"]'), -{x}, -{y});
        return [...copy.getImageData(0, 0, 1, 1).data];
    }})()"""
    pixel: list[int] = browser.evaluate(code)
    return pixel[:3]


def test_an_address_shows_its_frame_and_the_numbers_of_its_pixel(browser: Page, shown: Shown) -> None:
    for room, frame, x, y in ((1, 1, 9, 5), (2, 3, 40, 30)):
        browser.open(shown.page, f"#room={room}&frame={frame}&x={x}&y={y}")
        browser.wait("document.documentElement.dataset.depth")
        state = browser.state()
        scene = shown.bag.scenes[room - 1]
        images, pose = shown.bag.images[scene.camera_path[frame - 1].stamp_ns], scene.camera_path[frame - 1]
        assert (state["room"], state["frame"], state["x"], state["y"]) == (str(room), str(frame), str(x), str(y))
        assert state["layers"] == "color depth normals semantic instance"
        depth = float(images["depth"][y, x])
        assert state["depth"] == f"{depth:.3f} m"
        assert near(state["normal"], images["normals"][y, x], 0.012)
        assert state["class"] == NYU40[int(images["semantic"][y, x])].name
        names = {0: "room", 1: "door", 2: "window"} | {thing.id: thing.category for thing in scene.objects}
        assert state["object"] == names[int(images["instance"][y, x])]
        fx, fy, cx, cy = intrinsics(shown.bag.camera)
        point = world_from_optical(pose.position_m, pose.orientation) @ [(x - cx) / fx * depth, (y - cy) / fy * depth, depth, 1.0]
        assert near(state["world"], point[:3], 0.002)


def test_layers_are_painted_in_the_colours_of_their_pictures(browser: Page, shown: Shown) -> None:
    browser.open(shown.page, "#room=2&frame=2")
    images = shown.bag.images[shown.bag.scenes[1].camera_path[1].stamp_ns]
    for x, y in ((0, 0), (1, 0), (2, 0), (17, 8), (63, 47)):
        depth = depth_to_color(images["depth"])[y, x]
        assert np.abs(np.array(canvas_pixel(browser, "depth", x, y)) - depth).max() <= 1
        assert canvas_pixel(browser, "semantic", x, y) == list(NYU40[int(images["semantic"][y, x])].color)
        assert canvas_pixel(browser, "instance", x, y) == objects_to_color(images["instance"])[y, x].tolist()


def test_the_pointer_tells_numbers_and_a_click_keeps_them_in_the_address(browser: Page, shown: Shown) -> None:
    browser.open(shown.page)
    depth = shown.bag.images[shown.bag.scenes[0].camera_path[0].stamp_ns]["depth"]
    browser.point("#tiles figure:nth-child(2) .stage", 10.5 / 64, 20.5 / 48)
    assert browser.state()["depth"] == f"{depth[20, 10]:.3f} m"
    browser.point("#tiles figure:nth-child(5) .stage", 50.5 / 64, 7.5 / 48, click=True)
    assert browser.state()["depth"] == f"{depth[7, 50]:.3f} m"
    assert browser.evaluate("location.hash") == "#room=1&frame=1&x=50&y=7"
    browser.point("h1", 0.5, 0.5)
    assert browser.state()["x"] == "50", "a click keeps the pixel"
    for place, text in (((0, 0), "no hit"), ((1, 0), "invalid"), ((2, 0), "≥ 65.534 m")):
        browser.open(shown.page, f"#x={place[0]}&y={place[1]}")
        browser.wait("document.documentElement.dataset.depth")
        assert browser.state()["depth"] == text and not browser.state()["world"]


def test_keys_and_controls_move_through_the_bag_and_nothing_jumps(browser: Page, shown: Shown) -> None:
    browser.open(shown.page)
    places = "['#tiles', '#tables', '#plan', '#pixel'].map((name) => JSON.stringify(document.querySelector(name).getBoundingClientRect()))"
    before = browser.evaluate(places)
    at = "[document.documentElement.dataset.room, document.documentElement.dataset.frame].join()"
    for key, expected in (("ArrowRight", "1,2"), ("ArrowRight", "1,3"), ("ArrowRight", "1,1"), ("ArrowLeft", "1,3"), ("ArrowDown", "2,1")):
        browser.key(key)
        browser.wait(f"{at} === '{expected}'")
        assert browser.evaluate(places) == before
    browser.key("ArrowRight", SHIFT)
    assert (browser.state()["x"], browser.state()["y"]) == ("33", "24"), "one right of the middle"
    assert browser.evaluate(places) == before
    browser.key(" ")
    browser.wait(f"{at} === '2,2'")
    browser.key(" ")
    browser.key("o")
    browser.wait("document.documentElement.dataset.view === 'overlay'")
    assert browser.evaluate("[...document.querySelectorAll('#tiles figure')].filter(e => e.offsetHeight).length") == 1
    browser.key("o")
    browser.evaluate("(e => { e.value = 0; e.dispatchEvent(new Event('change')); })(document.getElementById('room'))")
    browser.wait(f"{at} === '1,1'")


def test_an_object_that_is_chosen_stands_out(browser: Page, shown: Shown) -> None:
    browser.open(shown.page)
    images = shown.bag.images[shown.bag.scenes[0].camera_path[0].stamp_ns]
    seen = browser.evaluate(
        "[...document.querySelectorAll('#objects tbody tr')].map(row => [row.cells[0].textContent, row.cells[6].textContent])"
    )
    counts = np.bincount(images["instance"].ravel(), minlength=7)
    assert seen == [[str(key), f"{counts[key]:,}"] for key in range(1, 7)]
    browser.point("#objects tbody tr:nth-child(3) button", 0.5, 0.5, click=True)
    browser.wait("document.querySelector('#plan .thing.chosen')?.dataset.id === '3'")
    ys, xs = np.nonzero(images["instance"] == 3)
    color = list(NYU40[int(images["semantic"][ys[0], xs[0]])].color)
    assert canvas_pixel(browser, "semantic", int(xs[0]), int(ys[0])) == color
    ys, xs = np.nonzero((images["instance"] != 3) & (images["semantic"] == 4))
    assert max(canvas_pixel(browser, "semantic", int(xs[0]), int(ys[0]))) < 100 < max(NYU40[4].color)
    browser.key("Escape")
    browser.wait("!document.querySelector('#plan .thing.chosen')")


def test_texts_of_a_hostile_bag_are_shown_as_texts(browser: Page, tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "<img src=x>", rooms=1, frames=1, labels={str(key): {"name": EVIL} for key in range(41)})
    write_page(bag.path, tmp_path / "page.html", rooms=8, frames=8, max_size=640)
    browser.open(tmp_path / "page.html", "#x=9&y=9&room=%3Cimg%3E")
    assert browser.evaluate("window.owned === undefined && document.scripts.length === 2 && document.images.length === 0")
    assert browser.evaluate("document.querySelector('#legend .label').textContent").endswith(f" {EVIL}")
    assert browser.evaluate("document.title") == "<img src=x>" == browser.evaluate("document.querySelector('h1').textContent")


@pytest.mark.parametrize("layers", [("depth",), ("color",), ()], ids=str)
def test_a_bag_that_lacks_things_still_has_a_page(browser: Page, tmp_path: Path, layers: tuple[str, ...]) -> None:
    bag = write_room_bag(tmp_path / "bag", rooms=1, frames=2, layers=layers)
    report = write_page(bag.path, tmp_path / "page.html", rooms=8, frames=8, max_size=640)
    browser.open(tmp_path / "page.html", "#frame=2&x=5&y=5")
    assert browser.state()["layers"] == " ".join(layers)
    told = browser.evaluate("[...document.querySelectorAll('#notes li')].map(line => line.textContent)")
    assert told == list(report.notes)
    browser.key("ArrowRight")
    browser.key("ArrowDown")
    browser.key("o")


def test_each_camera_has_its_layers_in_their_shape(browser: Page, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for metres, (side, width) in enumerate((("left", 40), ("right", 20)), start=1):
            depth = np.full((20, width), metres, np.float32)
            write(writer, f"/s/{side}/depth/image_raw", image_to_msg(depth, "32FC1", 5, side), 5)
    write_page(tmp_path / "bag", tmp_path / "page.html", rooms=8, frames=8, max_size=640)
    shape = "(({width, height}) => (width / height).toFixed(2))(document.querySelector('.stage').getBoundingClientRect())"
    for place, depth, ratio in (("", "1.000 m", "2.00"), ("camera=2&", "2.000 m", "1.00")):
        browser.open(tmp_path / "page.html", f"#{place}x=7&y=7")
        browser.wait("document.documentElement.dataset.depth")
        assert (browser.state()["depth"], browser.evaluate(shape)) == (depth, ratio)
    browser.evaluate("(e => { e.value = 0; e.dispatchEvent(new Event('change')); })(document.getElementById('camera'))")
    browser.wait("document.documentElement.dataset.depth === '1.000 m'")


def test_an_empty_bag_has_a_page(browser: Page, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag"):
        pass
    write_page(tmp_path / "bag", tmp_path / "page.html", rooms=8, frames=8, max_size=640)
    browser.open(tmp_path / "page.html")
    assert "the bag holds no messages" in browser.evaluate("document.querySelector('#notes').textContent")
    for key in ("ArrowRight", "ArrowDown", " ", "o", "Escape"):
        browser.key(key)


def test_changed_pixels_are_told_instead_of_wrong_numbers(browser: Page, shown: Shown, tmp_path: Path) -> None:
    """As with browsers that protect against fingerprinting: what scripts read is not what was written."""
    page = shown.page.read_text(encoding="utf-8")
    sums = json.loads(page.split('type="application/json">')[1].split("</script>")[0])["rooms"][0]["frames"][0]
    true = sums["cameras"]["/synth/camera"]["images"]["depth"]["sum"]
    (tmp_path / "page.html").write_text(page.replace(f'"sum":{true}', f'"sum":{true + 1}'), encoding="utf-8")
    browser.open(tmp_path / "page.html")
    assert "other pixels than the page holds" in browser.evaluate("document.getElementById('error').textContent")
    browser.events.clear()
    browser.call("Page.navigate", url="about:blank")
