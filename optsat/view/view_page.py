"""View page: the attitude of a record to be turned and played, in one file."""

from html import escape
from importlib.resources import files

from optsat.estimators.attitude_series import AttitudeSeries
from optsat.records.record import Record
from optsat.report.page import page
from optsat.view.scene import scene, scene_text

_MAGNIFICATIONS = {1: "true size", 10: "10 times", 100: "100 times", 1000: "1000 times"}


def view_page(record: Record, series: AttitudeSeries, title: str, every: int = 1) -> str:
    """Return the page; the same record and series give the same page.

    every : the series holds every n-th epoch of the record
    """
    document = scene(record, series, every)
    epochs, count = document["epochs"], document["count"]
    how = "past measurements carried by the gyro" if series.windowed else "each instant by itself"
    shown = (
        f"{epochs:,} instants"
        if count == epochs
        else f"{count:,} of {epochs:,} instants, every change, fault and refusal among them as far as there is room"
    )
    choices = "".join(f'<option value="{times}">{words}</option>' for times, words in _MAGNIFICATIONS.items())
    truth = " Crosses mark where the body axes truly point." if document["truth"] is not None else ""
    body = f"""<header><h1>{escape(title)}</h1><p class="quiet">{shown}; {how}</p></header>
<main>
<input id="time" type="range" min="0" max="{count - 1}" value="0" step="1" aria-label="instant">
<canvas id="lanes" aria-hidden="true"></canvas>
<div id="stage">
<div><canvas id="globe" tabindex="0" role="img" aria-label="Body axes, directions and their bounds on the unit sphere; \
arrow keys turn it"></canvas></div>
<div><div id="readout" aria-live="off"><dl></dl></div>
<div class="tools"><button id="play">Play</button><button id="before">Previous mark</button>\
<button id="after">Next mark</button><button id="frame">Seen from N</button>
<label>Bounds and errors <select id="magnify">{choices}</select></label></div>
<p class="quiet">Drag to turn. Thick arrows are the body axes; each surely lies within its shaded cap, as the attitude \
surely lies within its bound. Rings are reference directions, dots with a cone are what was measured, red is what was \
rejected.{truth} A measurement is listed with its angle to the reference and the bound of that angle.</p></div>
</div>
<noscript><p>This page is drawn by a script.</p></noscript>
</main>"""
    return page(title, body, _asset("view.js"), _asset("view.css"), {"scene": scene_text(document)})


def _asset(name: str) -> str:
    return files("optsat.view").joinpath(name).read_text(encoding="utf-8")
