"""Chromium without a window, a network or a GPU, for the tests that look at report.html."""

import contextlib
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-background-networking", "--no-first-run", "--window-size=1000,900",
)  # fmt: skip

PATIENCE = 90
"""Seconds that a picture may take on a busy machine."""


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """A selenium driver whose network is off; skips where there is no Chromium."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    browser, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("chromium and chromedriver are not installed; apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    opened = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        opened.execute_cdp_cmd("Network.enable", {})
        off = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
        opened.execute_cdp_cmd("Network.emulateNetworkConditions", off)
        yield opened
    finally:
        opened.quit()


def wait_for(condition: Any) -> None:
    """Until it holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "the page did not get there"
        time.sleep(0.1)


def open_page(browser: Any, page: Path) -> None:
    """Load a report from disk and wait for its first picture."""
    browser.get(page.resolve().as_uri())
    wait_for(lambda: browser.execute_script("return document.getElementById('view').dataset.drawn === 'yes'"))


def canvas(browser: Any) -> NDArray[np.float64]:
    """What the view shows, once it has drawn what was asked: (H, W, 3) in [0, 1]."""
    import base64
    import io

    import PIL.Image

    script = """
    const done = arguments[0], picture = () => done(document.getElementById("view").toDataURL("image/png"));
    requestAnimationFrame(() => requestAnimationFrame(picture));"""
    data = browser.execute_async_script(script).split(",")[1]
    return np.asarray(PIL.Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")) / 255


def set_input(browser: Any, selector: str, value: str | None) -> None:
    """Move a slider, or choose a radio button when there is no value."""
    script = """
    const input = document.querySelector(arguments[0]);
    if (arguments[1] === null) { input.click(); return; }
    input.value = arguments[1];
    input.dispatchEvent(new Event("input", { bubbles: true }));"""
    browser.execute_script(script, selector, value)


def messages(browser: Any) -> list[str]:
    """What the console said."""
    return [entry["message"] for entry in browser.get_log("browser")]


def requests(browser: Any) -> list[str]:
    """Addresses that were asked for, but for those inside of the page itself."""
    import json

    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    sent = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
    return [url for url in sent if not url.startswith(("data:", "blob:", "about:", "chrome:"))]
