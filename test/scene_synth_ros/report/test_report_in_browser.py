"""The report in a real browser: charts tell their values, controls change them, the slider moves, nothing is loaded, nothing acts.

``make test`` runs this where a Chromium is installed (``apt install chromium``).
"""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import Page
from evaluation_files import METRICS, document, frame, write
from needed_tools import need
from report_bag import write_sweep

from scene_synth_ros.report.report_file import write_report

pytestmark = pytest.mark.browser
EVIL = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    need("chromium")
    with Page(tmp_path_factory.mktemp("profile")) as page:
        yield page


def page_of(*paths: Path) -> Path:
    page = paths[0].with_suffix(".html")
    write_report(paths, page, bag_root=None, estimates=None, worst=2, max_size=64, progress=lambda _what: None)
    return page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    return page_of(write_sweep(folder), write_sweep(folder, shift=0.25, title="wider"))


@pytest.fixture(autouse=True)
def no_complaints(browser: Page) -> Iterator[None]:
    """Whatever a test does, the page raises nothing, the browser complains of nothing, and nothing is loaded."""
    browser.events.clear()
    yield
    assert browser.complaints() == [] and "error" not in browser.state()


def texts(browser: Page, selector: str) -> list[str]:
    found: list[str] = browser.evaluate(f"[...document.querySelectorAll({selector!r})].map((node) => node.textContent)")
    return found


def change(browser: Page, control: str, value: str) -> None:
    browser.evaluate(f"(e => {{ e.value = {value!r}; e.dispatchEvent(new Event('change')); }})(document.getElementById({control!r}))")


def test_charts_tell_their_values_to_pointer_and_keys(browser: Page, report: Path) -> None:
    browser.open(report)
    assert texts(browser, "#curves figcaption") == ["light (lx)", "finish"]
    assert browser.evaluate("document.querySelectorAll('#curves .chart:first-child .band').length") == 2
    assert browser.evaluate("document.querySelectorAll('#curves .chart .base').length") == 2, "the base is marked"
    browser.point("#curves .chart:first-child svg", 0.99, 0.5)
    assert texts(browser, "#curves .chart:first-child .tip > *") == [
        "2 lx",
        "1.6  [0.0, 8.0], 2 rooms, 6 frames",
        "1.9  [0.0, 8.2], 2 rooms, 6 frames",
    ]
    browser.point("h1", 0.5, 0.5)
    assert browser.evaluate("document.querySelector('#curves .tip').hidden")
    browser.evaluate("document.querySelectorAll('#curves svg[tabindex]')[1].focus()")
    browser.key("ArrowRight")
    assert texts(browser, "#curves .chart:last-child .tip b") == ["paint, base"]
    browser.key("ArrowRight")
    assert texts(browser, "#curves .chart:last-child .tip b") == ["brick"]


def test_metric_and_evaluations_are_chosen_and_the_address_keeps_them(browser: Page, report: Path) -> None:
    browser.open(report)
    assert browser.state()["metric"] == "abs_rel" and texts(browser, "#ranking td:first-child") == ["light", "finish"]
    assert texts(browser, "#scores tbody tr:first-child td")[-1] == "0.25  [0.25, 0.25] ▼ worse"
    before = texts(browser, "#curves .axis")
    change(browser, "metric", "delta_1")
    assert browser.state()["metric"] == "delta_1" and texts(browser, "#curves .axis") != before
    assert browser.evaluate("location.hash") == "#task=depth&metric=delta_1"
    assert "delta 1, higher is better" in texts(browser, "#curves .axis")
    browser.point("#legend button:last-child", 0.5, 0.5, click=True)
    assert browser.evaluate("document.querySelectorAll('#curves .chart:first-child .band').length") == 1
    assert texts(browser, "#frames h3.of") == ["SGBM"]
    browser.open(report, "#task=depth&metric=delta_1")
    assert browser.state()["metric"] == "delta_1"
    browser.point("#scores tbody tr:first-child button", 0.5, 0.5, click=True)
    assert browser.state()["metric"] == "abs_rel"


def test_estimates_that_were_not_kept_are_said_to_be_in_place_of_picture_and_error(browser: Page, report: Path) -> None:
    content = json.loads(report.with_name("SGBM.json").read_text()) | {"created_with": "scene_synth evaluate bag --algorithm far.py:Far"}
    browser.open(page_of(write(report.with_name("far.json"), content)))
    assert texts(browser, ".frame:first-child figcaption") == ["colour", "truth", "estimate", "error"]
    assert texts(browser, ".frame:first-child .missing") == ["the estimates were not kept: evaluate with --estimates-out"] * 2


def test_the_slider_moves_the_border_between_estimate_and_truth(browser: Page, report: Path) -> None:
    browser.open(report)
    loaded = "[...document.images].every((image) => image.complete && image.naturalWidth === 64)"
    assert browser.evaluate(f"document.images.length === 20 && {loaded}")
    clip = "document.querySelector('.frame .stage img + img').style.clipPath"
    assert browser.evaluate(clip) == "inset(0px 50% 0px 0px)"
    browser.point(".frame .stage input", 0.25, 0.5, click=True)
    assert browser.evaluate(clip) == "inset(0px 75% 0px 0px)" and browser.evaluate("document.querySelector('.border').style.left") == "25%"
    browser.evaluate("document.querySelector('.frame .stage input').focus()")
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", code="ArrowRight", windowsVirtualKeyCode=39)
    assert browser.evaluate(clip) == "inset(0px 74% 0px 0px)"
    assert texts(browser, ".frame:nth-child(2) .scale li") == ["≤ −0.1 m", "0 m", "≥ 0.1 m"]


def test_the_command_of_a_frame_is_copied(browser: Page, report: Path) -> None:
    browser.open(report)
    assert texts(browser, ".frame .command code")[0] == "scene_synth sweep s.yaml --only 0001"
    browser.point(".frame .command button", 0.5, 0.5, click=True)
    browser.wait("['Copied', 'Selected'].includes(document.querySelector('.frame .command button').textContent)")


def test_a_phone_scrolls_in_one_direction_only(browser: Page, report: Path) -> None:
    browser.call("Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=1, mobile=False)
    browser.open(report)
    assert browser.evaluate("document.documentElement.scrollWidth") <= 360
    browser.call("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)


def test_texts_of_a_hostile_evaluation_are_shown_as_texts(browser: Page, tmp_path: Path) -> None:
    tasks = [{"name": EVIL, "metrics": [METRICS[0] | {"name": EVIL, "unit": EVIL}]}]
    score = {EVIL: {"value": 1.0, "low": 0.5, "high": 2.0}}
    summary = [{"task": EVIL, "by": "class", "key": EVIL, "metrics": score, "rooms": 1, "frames": 1}]
    frames = [
        frame("0", room, {EVIL: value}, {EVIL: 1.0 + room}, bag=EVIL, room_type=EVIL, task=EVIL) for value in (EVIL, "b") for room in (0, 1)
    ]
    content = document(frames, summary, tasks=tasks, title=EVIL, algorithm=EVIL, created_with=EVIL, missing={EVIL: 1})
    browser.open(page_of(write(tmp_path / "a.json", content)))
    assert browser.evaluate("window.owned === undefined && document.scripts.length === 2 && document.images.length === 0")
    assert browser.evaluate("document.title") == EVIL == texts(browser, "h1")[0]
    assert texts(browser, "#curves figcaption") == [EVIL] and EVIL.replace("_", " ") in texts(browser, "#breakdowns td:first-child")
    assert texts(browser, "#runs code") == [EVIL]


@pytest.mark.parametrize("name", ["constructor", "__proto__", "toString"])
def test_names_that_scripts_know_are_names_like_others(browser: Page, tmp_path: Path, name: str) -> None:
    tasks = [{"name": name, "metrics": [METRICS[0], METRICS[0] | {"name": name}]}, {"name": "depth", "metrics": METRICS[:1]}]
    frames = [frame("0", room, {name: value}, {"abs_rel": 1.0 + room, name: None}, task=name) for value in ("a", "b") for room in (0, 1)]
    browser.open(page_of(write(tmp_path / "a.json", document(frames, tasks=tasks))))
    assert texts(browser, "#curves figcaption") == [name] and texts(browser, "#ranking td:first-child") == [name]
    change(browser, "metric", name)
    assert browser.state()["metric"] == name and texts(browser, "#ranking") == [""]
    change(browser, "task", "1")
    assert browser.state()["task"] == "depth" and texts(browser, "#curves") == [""]


def test_an_evaluation_without_factors_has_a_page(browser: Page, tmp_path: Path) -> None:
    frames = [frame("0", 0, {}, {"abs_rel": None, "delta_1": None})]
    browser.open(page_of(write(tmp_path / "a.json", document(frames))))
    assert browser.evaluate("document.getElementById('curves-part').hidden && document.getElementById('ranking-part').hidden")
    assert texts(browser, "#notes li") == ["1 of 1 bags not found, so no pictures of them: variants/0; give --bag-root DIR"]
    assert texts(browser, "#frames-hint") == ["Single frames have no values of this task."]
