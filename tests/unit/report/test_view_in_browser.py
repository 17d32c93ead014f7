"""The view in a real browser: silent, where things are drawn, turned by hand, readable, on a phone."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium
from looks import VISIBLE, assert_alone, assert_fits_a_phone, contrast, text_contrasts
from viewed_record import record, series

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.view.view_page import view_page

_READ = """return Object.fromEntries([...document.querySelectorAll("#readout dl div")]
  .map(d => [d.children[0].textContent, d.children[1].textContent]))"""
_GO = """const slider = document.getElementById("time");
slider.value = arguments[0]; slider.dispatchEvent(new Event("input"))"""
_BOX = """const box = document.getElementById(arguments[0]).getBoundingClientRect();
return [box.left, box.top, box.width, box.height]"""
_CLICK = "document.getElementById(arguments[0]).click()"
_COLOUR = "return getComputedStyle(document.documentElement).getPropertyValue(arguments[0]).trim()"
_YAW, _PITCH = 0.6, 0.35


@pytest.fixture(scope="module")
def windowed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    page = tmp_path_factory.mktemp("view") / "windowed.html"
    page.write_text(view_page(record(), series(windowed=True), "A minute in orbit"))
    return page


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    page = tmp_path_factory.mktemp("view") / "single.html"
    page.write_text(view_page(record(), series(windowed=False), "A minute in orbit"))
    return page


def _open(browser: Chromium, page: Path) -> None:
    browser.open(page)
    browser.resize(1100, 1000)


def _globe(browser: Chromium) -> np.ndarray:
    left, top, width, height = browser.script(_BOX, "globe")
    return browser.picture()[round(top) : round(top + height), round(left) : round(left + width)]


def _place(v: Array, size: int) -> tuple[int, int]:
    """Return row and column of a vector in N on the globe, by the textbook: turned about z, then tilted."""
    turned = np.array([[-np.sin(_YAW), np.cos(_YAW), 0], [np.cos(_YAW), np.sin(_YAW), 0], [0, 0, 1]]) @ v
    height = np.cos(_PITCH) * turned[2] - np.sin(_PITCH) * turned[1]
    return round(size / 2 - 0.4 * size * height), round(size / 2 + 0.4 * size * turned[0])


def test_it_opens_alone_and_without_complaint(browser: Chromium, windowed: Path, single: Path) -> None:
    for page in (windowed, single):
        _open(browser, page)
        assert_alone(browser, page)


def test_the_body_axes_are_drawn_where_they_point(browser: Chromium, windowed: Path) -> None:
    _open(browser, windowed)
    for epoch in (0, 30, 60):
        browser.script(_GO, epoch)
        shot = _globe(browser)
        size = shot.shape[0]
        for k, name in enumerate("xyz"):
            wanted = browser.script(_COLOUR, f"--axis-{name}")
            colour = np.array([int(wanted[i : i + 2], 16) for i in (1, 3, 5)])
            axis = quaternion.transform(quaternion.inverse(series(windowed=True).q_BN[epoch]), np.eye(3)[k])
            row, column = _place(0.75 * np.asarray(axis), size)
            seen = shot[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3).astype(float)
            behind = shot[5, 5].astype(float)
            # an axis that points away is drawn paler: its colour lies between that of the paper and its own
            share = (behind - seen) @ (behind - colour) / np.sum((behind - colour) ** 2)
            assert share.max() > 0.2
            best = seen[np.argmax(share)]
            assert np.abs(behind + share.max() * (colour - behind) - best).max() < 60


def test_the_readout_is_that_of_the_series(browser: Chromium, windowed: Path) -> None:
    _open(browser, windowed)
    one = series(windowed=True)
    for epoch in (0, 22, 50):
        browser.script(_GO, epoch)
        said = browser.script(_READ)
        assert said["time"] == f"{epoch} s"
        assert said["attitude"] == "ok"
        assert float(said["guaranteed bound"].rstrip("°")) == pytest.approx(np.degrees(one.bound_rad[epoch]), rel=6e-3)
        assert said["magnetometer"] == "rejected" if epoch == 22 else " of 0.5°" in said["magnetometer"]
        assert (said["sun"] == "missing") is (epoch == 50)


def test_marks_are_found_one_after_the_other(browser: Chromium, single: Path) -> None:
    _open(browser, single)
    found = []
    for _ in range(2):
        browser.script(_CLICK, "after")
        found.append((browser.script(_READ)["time"], browser.script(_READ)["attitude"]))
    assert found == [("20 s", "inconsistent"), ("40 s", "unbounded")]
    assert browser.script("return document.getElementById('after').disabled")
    browser.script(_CLICK, "before")
    assert browser.script(_READ)["time"] == "20 s"


def test_it_turns_by_hand_changes_frame_size_and_instant(browser: Chromium, windowed: Path) -> None:
    _open(browser, windowed)
    pictures = [_globe(browser)]
    browser.drag("#globe", 80, 30)
    pictures.append(_globe(browser))
    browser.script(_CLICK, "frame")
    pictures.append(_globe(browser))
    browser.script("const s = document.getElementById('magnify'); s.value = '1'; s.dispatchEvent(new Event('change'))")
    pictures.append(_globe(browser))
    browser.script(_GO, 45)
    pictures.append(_globe(browser))
    for before, after in itertools.pairwise(pictures):
        assert np.mean(np.any(before != after, axis=2)) > 0.002
    assert_alone(browser, windowed)


def test_dragging_to_the_right_moves_the_front_to_the_right(browser: Chromium, windowed: Path) -> None:
    _open(browser, windowed)
    browser.script(_GO, 0)
    # the axis y of N lies in front and to the right; by a drag of its own radius it turns on by one radian
    size = _globe(browser).shape[0]
    browser.drag("#globe", round(0.4 * size * -0.5), 0)
    shot = _globe(browser)
    yaw = _YAW + 0.5
    column = round(size / 2 + 0.4 * size * 0.7 * np.cos(yaw))
    row = round(size / 2 + 0.4 * size * np.sin(_PITCH) * 0.7 * np.sin(yaw))
    around = shot[row - 2 : row + 3, column - 2 : column + 3].reshape(-1, 3).astype(int)
    assert np.abs(around - shot[5, 5]).max() > 60, "the axis is drawn there"


def test_it_plays_to_the_end(browser: Chromium, windowed: Path) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    _open(browser, windowed)
    browser.script(_CLICK, "play")
    WebDriverWait(browser.driver, 60).until(
        lambda driver: driver.execute_script("return document.getElementById('play').textContent") == "Play"
    )
    assert browser.script(_READ)["time"] == "60 s"


def test_it_is_readable_in_light_and_dark(browser: Chromium, single: Path) -> None:
    for dark in (False, True):
        _open(browser, single)
        browser.dark(dark)
        browser.script(_GO, 22)
        assert text_contrasts(browser).min() >= VISIBLE
        for name in ("globe", "lanes"):
            left, top, width, height = map(round, browser.script(_BOX, name))
            part = browser.picture()[top : top + height, left : left + width]
            assert contrast(part) >= VISIBLE
            # drawn anew in the colours of the scheme: the paper is dark in the dark
            assert (np.median(part) < 60) if (dark and name == "globe") else True


def test_it_fits_a_phone(browser: Chromium, windowed: Path, single: Path) -> None:
    for page in (windowed, single):
        browser.open(page)
        assert_fits_a_phone(browser)
        assert browser.script(_BOX, "globe")[2] > 300
