"""Chromium: a page opened in a real browser, looked at in the light, in the dark and on a phone."""

import base64
import contextlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

_FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-first-run", "--hide-scrollbars"),
    "--force-device-scale-factor=1",
)
_PATIENCE_S = 60


@dataclass(frozen=True)
class Chromium:
    """A browser with one window."""

    driver: Any

    def open(self, page: Path) -> None:
        """Load a page from the disk, after forgetting what was said about the one before."""
        self.driver.get("about:blank")
        self.said()
        self.requests()
        self._cdp("Emulation.clearDeviceMetricsOverride")
        self.dark(False)
        self.driver.get(page.resolve().as_uri())

    def script(self, text: str, *arguments: object) -> Any:
        """Run a script in the page and return its value."""
        return self.driver.execute_script(text, *arguments)

    def dark(self, on: bool) -> None:
        """Prefer dark pages, or light ones."""
        features = [{"name": "prefers-color-scheme", "value": "dark" if on else "light"}]
        self._cdp("Emulation.setEmulatedMedia", media="", features=features)

    def printing(self) -> None:
        """Show the page as it would be printed."""
        self._cdp("Emulation.setEmulatedMedia", media="print", features=[])

    def resize(self, width: int, height: int, phone: bool = False) -> None:
        """Show the page on a screen of that size in CSS pixels."""
        self._cdp("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)

    def picture(self, whole: bool = False) -> NDArray[np.uint8]:
        """Return what is seen, (rows, columns, 3); the whole page where asked."""
        from matplotlib.image import imread

        shot = self._cdp("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        return np.round(255 * imread(BytesIO(base64.b64decode(shot)))[..., :3]).astype(np.uint8)

    def said(self) -> list[dict[str, Any]]:
        """Return the lines of the console since they were last read."""
        return list(self.driver.get_log("browser"))

    def complaints(self) -> list[str]:
        """Return errors of the console since it was last read, refused requests among them."""
        return [line["message"] for line in self.said() if line["level"] == "SEVERE"]

    def requests(self) -> list[str]:
        """Return the addresses that were asked for since they were last read."""
        messages = [json.loads(line["message"])["message"] for line in self.driver.get_log("performance")]
        return [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]

    def drag(self, selector: str, right: int, down: int) -> None:
        """Press on the middle of an element, move, and let go."""
        from selenium.webdriver import ActionChains

        element = self.driver.find_element("css selector", selector)
        ActionChains(self.driver).click_and_hold(element).move_by_offset(right, down).release().perform()

    def _cdp(self, command: str, **parameters: object) -> Any:
        return self.driver.execute_cdp_cmd(command, parameters)


@contextlib.contextmanager
def started(profile: Path) -> Iterator[Chromium]:
    """Start Chromium with a fresh profile; skip the test where there is none, fail it where CI promises one."""
    missing = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    missing += ["selenium"] if find_spec("selenium") is None else []
    if missing:
        reason = f"no {' and no '.join(missing)} (Debian: apt-get install chromium chromium-driver; pip: selenium)"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for flag in (*_FLAGS, f"--user-data-dir={profile}", "--window-size=1100,900"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(str(shutil.which("chromedriver"))))
    driver.set_page_load_timeout(_PATIENCE_S)
    try:
        yield Chromium(driver)
    finally:
        driver.quit()
