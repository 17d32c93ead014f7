"""Looks: what every page of optsat must be to the eye, measured on pixels."""

import time
from pathlib import Path

import numpy as np
from chromium import Chromium
from numpy.typing import NDArray

READABLE = 4.5
"""Least contrast of text, W3C WCAG 2.2, success criterion 1.4.3."""
VISIBLE = 3.0
"""Least contrast of drawings and large text, criterion 1.4.11."""

_PHONE = (380, 800)
_SETTLED_S = 5.0

_BOXES = """
const seen = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const owner = walker.currentNode.parentElement;
  if (!walker.currentNode.data.trim() || owner.closest("script, style, noscript, :disabled")) continue;
  const range = document.createRange();
  range.selectNodeContents(walker.currentNode);
  const box = range.getClientRects()[0];
  if (box && box.width > 2 && box.right <= innerWidth && box.bottom <= innerHeight && box.top >= 0 && box.left >= 0)
    seen.push([box.left, box.top, box.right, box.bottom]);
}
for (const group of document.querySelectorAll("svg .text")) {
  const box = group.getBoundingClientRect();
  if (box.width > 2 && box.right <= innerWidth && box.bottom <= innerHeight)
    seen.push([box.left, box.top, box.right, box.bottom]);
}
return seen;
"""


def contrast(pixels: NDArray[np.uint8]) -> float:
    """Return the contrast ratio of the lightest and the darkest pixel."""
    return _ratio(_luminance(pixels))


def text_contrasts(browser: Chromium) -> NDArray[np.float64]:
    """Return the contrast of each piece of text in the window, letters of figures among them."""
    boxes = browser.script(_BOXES)
    shot = _luminance(browser.picture())
    return np.array([_ratio(shot[int(t) : int(b) + 1, int(le) : int(r) + 1]) for le, t, r, b in boxes])


def _ratio(luminance: NDArray[np.float64]) -> float:
    return float((luminance.max() + 0.05) / (luminance.min() + 0.05))


def _luminance(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    levels = np.arange(256) / 255
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear[pixels] @ (0.2126, 0.7152, 0.0722))


def assert_readable(browser: Chromium) -> None:
    """Every text stands out from what is behind it, in the light and in the dark."""
    for dark in (False, True):
        browser.dark(dark)
        contrasts = text_contrasts(browser)
        assert len(contrasts) > 20
        assert contrasts.min() >= READABLE, "dark" if dark else "light"
        corner = browser.picture()[2, 2].mean()
        assert (corner < 60) if dark else (corner > 235)


def assert_fits_a_phone(browser: Chromium) -> None:
    """On a phone the page is as wide as the screen and nothing makes it wider."""
    browser.resize(*_PHONE, phone=True)
    # on a busy machine the new size reaches the page a moment later; one laid out wider than the screen never has it
    end = time.monotonic() + _SETTLED_S
    while browser.script("return innerWidth") != _PHONE[0] and time.monotonic() < end:
        time.sleep(0.05)
    assert browser.script("return innerWidth") == _PHONE[0]
    assert browser.script("return document.documentElement.scrollWidth") <= _PHONE[0]


def assert_alone(browser: Chromium, page: Path) -> None:
    """The console has no complaint and nothing but the page itself was asked for."""
    assert browser.complaints() == []
    asked = [address for address in browser.requests() if not address.startswith("data:")]
    assert asked == [page.resolve().as_uri()]
