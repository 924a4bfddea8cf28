"""A headless Chromium for tests, driven over its own pipe (Chrome DevTools Protocol): no library, no port."""

from __future__ import annotations

import base64
import json
import os
import select
import subprocess
import time
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

from needed_tools import find_chromium

TIMEOUT_S = 60.0


class Page:
    """A page of a browser of its own, which ends with it.

    Args:
        profile: an empty folder.
        width, height: of the window, pixels.
        dark: whether the user prefers dark colours.
    """

    def __init__(self, profile: Path, width: int = 1400, height: int = 900, *, dark: bool = False) -> None:
        program = find_chromium()
        assert program is not None
        to_browser, self._out = os.pipe()
        self._in, from_browser = os.pipe()
        quiet = ("--no-first-run", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars")
        window = (f"--window-size={width},{height}", f"--blink-settings=preferredColorScheme={0 if dark else 1}")
        words = ["--headless=new", "--no-sandbox", *quiet, *window, f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank"]
        # the browser reads file 3 and writes file 4; sh would take no file above 9
        shell = ["bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "bash", program, *words]
        self._process = subprocess.Popen(
            shell, pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        os.close(to_browser)
        os.close(from_browser)
        self._numbers, self._buffer, self._session = count(1), b"", ""
        self.events: list[dict[str, Any]] = []
        targets = self.call("Target.getTargets")["targetInfos"]
        target = next(info["targetId"] for info in targets if info["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def __enter__(self) -> Page:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.kill()
        self._process.wait(10)
        os.close(self._out)
        os.close(self._in)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result; events are kept."""
        number = next(self._numbers)
        request: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session:
            request["sessionId"] = self._session
        os.write(self._out, json.dumps(request).encode() + b"\0")
        while True:
            message = self._receive()
            if message.get("id") == number:
                assert "error" not in message, f"{method}: {message['error']}"
                result: dict[str, Any] = message["result"]
                return result
            self.events.append(message)

    def _receive(self) -> dict[str, Any]:
        end = time.monotonic() + TIMEOUT_S
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._in], [], [], max(end - time.monotonic(), 0.0))
            data = os.read(self._in, 1 << 20) if ready else b""
            assert data, f"the browser said nothing for {TIMEOUT_S:g} s, or has ended with {self._process.poll()}"
            self._buffer += data
        text, _, self._buffer = self._buffer.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        return message

    def open(self, path: Path, place: str = "") -> None:
        """Open a file, at a place (``#...``), and wait until its script says that it is ready or at fault."""
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=f"{path.resolve().as_uri()}{place}")
        self.wait("['state', 'error'].some((name) => document.documentElement?.dataset[name])")

    def evaluate(self, code: str) -> Any:
        """Return the value of an expression in the page."""
        result = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, code: str) -> None:
        """Wait until an expression in the page is true."""
        end = time.monotonic() + TIMEOUT_S
        while not self.evaluate(f"Boolean({code})"):
            assert time.monotonic() < end, f"still not true: {code}; the page says {self.state()}"
            time.sleep(0.02)

    def state(self) -> dict[str, str]:
        """Return what the page tells of itself on its root element (``data-*``)."""
        return dict(self.evaluate("({...document.documentElement.dataset})"))

    def point(self, selector: str, u: float, v: float, *, click: bool = False) -> None:
        """Move the mouse to shares (u, v) of an element's width and height, and press its left button there."""
        element = f"document.querySelector({json.dumps(selector)})"
        self.evaluate(f"{element}.scrollIntoView({{block: 'nearest'}})")
        box = self.evaluate(f"(({{x, y, width, height}}) => [x, y, width, height])({element}.getBoundingClientRect())")
        place = {"x": box[0] + u * box[2], "y": box[1] + v * box[3]}
        self.call("Input.dispatchMouseEvent", type="mouseMoved", **place)
        for kind in ("mousePressed", "mouseReleased") if click else ():
            self.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)

    def key(self, key: str, modifiers: int = 0) -> None:
        """Press a key, named as in KeyboardEvent.key; modifiers: 8 is shift."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=modifiers)

    def complaints(self) -> list[str]:
        """Return what the browser complained of: exceptions, console errors, refused loads; and addresses outside the page."""
        found = []
        for event in self.events:
            method, parameters = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append(str(parameters["exceptionDetails"].get("exception", {}).get("description")))
            elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
                found.append(parameters["entry"]["text"])
            elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
                found.append(str(parameters["args"]))
            elif method == "Network.requestWillBeSent" and not parameters["request"]["url"].startswith(("file:", "data:", "about:")):
                found.append(f"loads {parameters['request']['url']}")
        return found

    def screenshot(self, path: Path) -> None:
        """Write what is seen as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
