"""Size of the pages that are written for people, and the time until a browser shows them and answers.

Reports of 10,000 and 100,000 cases and the view of an hour in orbit, in headless Chromium that draws by software; needs
chromium, chromedriver and selenium (extra `dev`). Time runs from the start of the navigation to the end of loading and
the first paint, whichever is later, and for the view to the first picture after its slider was moved.
"""

import contextlib
import importlib
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.finished_run import read_run
from optsat.campaign.runner import run_study
from optsat.campaign.study import Case, Row, Study
from optsat.errors import MissingExtraError
from optsat.estimators.attitude_series import certify_record
from optsat.report.html_report import html_report
from optsat.simulation.scenario_file import parse_scenario
from optsat.studies import _trivial_batch
from optsat.view.view_page import view_page

PAGES = ("report_10000", "report_100000", "view")
ROUNDS = 5
MOST_MB = {"report_10000": 0.6, "report_100000": 3.0, "view": 6.0}
MOST_S = {"report_10000": 1.0, "view": 5.0}
_FLAGS = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--no-first-run")
_SCENARIO = """
duration_s = 3600
[sun]
eclipse = true
[gyro]
bound_deg_s = 0.002
"""
_LOADED = """const [page] = performance.getEntriesByType("navigation");
const paints = performance.getEntriesByType("paint").map(paint => paint.startTime);
return Math.max(page.loadEventEnd, ...paints)"""
_MOVED = """const done = arguments[0], start = performance.now(), slider = document.getElementById("time");
slider.value = Math.round(slider.max / 2); slider.dispatchEvent(new Event("input"));
requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - start)))"""


def cases(count: int) -> list[Case]:
    """Return the pages in turn."""
    return [{"page": PAGES[k % len(PAGES)]} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the size of a page [MB] and the median time until it is there and answers [s]."""
    name = case["page"]
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder, "page.html")
        with browser(Path(folder, "profile")) as driver:
            page.write_bytes(_page(name, Path(folder, "run"), rng))
            times = [_second(driver, page, name == "view") for _ in range(ROUNDS)]
        return {"page": name, "mb": page.stat().st_size / 1e6, "ready_s": float(np.median(times))}


def _page(name: str, folder: Path, rng: np.random.Generator) -> bytes:
    if name == "view":
        record = parse_scenario(_SCENARIO, "hour").simulate(rng)
        return view_page(record, certify_record(record), "An hour in orbit").encode()
    run_study(_trivial_batch.study, int(name.rpartition("_")[2]), out=folder)
    return html_report(read_run(folder)).encode()


@contextlib.contextmanager
def browser(profile: Path) -> Iterator[Any]:
    """Start Chromium with a profile of its own.

    Raises
    ------
    MissingExtraError : a part of it is absent.
    """
    missing = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    webdriver: Any = None
    try:
        webdriver = importlib.import_module("selenium.webdriver")
    except ImportError:
        missing.append("selenium")
    if missing:
        raise MissingExtraError(
            f"Without {' and '.join(missing)} no page can be timed: apt-get install chromium chromium-driver, "
            "pip install 'optsat[dev]'."
        )
    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for flag in (*_FLAGS, f"--user-data-dir={profile}", "--window-size=1100,900"):
        options.add_argument(flag)
    driver = webdriver.Chrome(options, webdriver.ChromeService(str(shutil.which("chromedriver"))))
    try:
        yield driver
    finally:
        driver.quit()


def _second(driver: Any, page: Path, moves: bool) -> float:
    driver.get("about:blank")
    driver.get(page.as_uri())
    ready = driver.execute_script(_LOADED)
    return float(ready + (driver.execute_async_script(_MOVED) if moves else 0.0)) / 1000


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return size and time of each page, the median over the rounds."""
    figures: dict[str, float] = {}
    for page in dict.fromkeys(row["page"] for row in rows):
        for name in ("mb", "ready_s"):
            figures[f"{page}_{name}"] = float(np.median([row[name] for row in rows if row["page"] == page]))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on size and time."""
    bars = [(page, "mb", most, "MB") for page, most in MOST_MB.items()]
    bars += [(page, "ready_s", most, "s") for page, most in MOST_S.items()]
    says = {"mb": "size", "ready_s": "ready in software-rendered Chromium"}
    return [
        judge_bar(
            f"{page}-{name}".replace("_", "-"),
            f"{page.replace('_', ' of ')}: {says[name]} < {most:g} {unit} [{unit}]",
            measured=figures[f"{page}_{name}"],
            holds=figures[f"{page}_{name}"] < most,
        )
        for page, name, most, unit in bars
        if f"{page}_{name}" in figures
    ]


study = Study(
    name="pages-timing",
    title="Reports and views: size, and time until a browser shows them",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=len(PAGES),
)
