"""Page: one HTML file that needs nothing else, opens from a disk, in the light and in the dark."""

import base64
import hashlib
from html import escape
from importlib.resources import files

_LIGHT, _DARK = ((0x1B, 0x1F, 0x24), (0xFF, 0xFF, 0xFF)), ((0xE7, 0xEA, 0xEE), (0x14, 0x17, 0x1B))
_STEPS = 15


def page(title: str, body: str, script: str = "", style: str = "", data: dict[str, str] | None = None) -> str:
    """Return a whole page.

    body : HTML, escaped where it must be; script : the one script of the page, the only one it will run
    style : rules beside those of all pages; data : JSON texts by the name of their element
    """
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    if script:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        policy += f"; script-src 'sha256-{digest}'"
    blocks = "".join(
        f'<script type="application/json" id="{name}">{text.replace("<", chr(92) + "u003c")}</script>\n'
        for name, text in (data or {}).items()
    )
    end = f"<script>{script}</script>\n" if script else ""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<link rel="icon" href="data:,">
<style>
{_common_style()}{style}</style>
</head>
<body>
{body}
{blocks}{end}</body>
</html>
"""


def asset(name: str) -> str:
    """Return a file of this package as text."""
    return files("optsat.report").joinpath(name).read_text(encoding="utf-8")


def _common_style() -> str:
    return asset("page.css").replace("LIGHT_GREYS", _greys(*_LIGHT)).replace("DARK_GREYS", _greys(*_DARK))


def _greys(ink: tuple[int, int, int], paper: tuple[int, int, int]) -> str:
    """Return the variables that figures are drawn in: from ink (0) to paper (15)."""
    mixed = [
        "".join(f"{round(a + (b - a) * k / _STEPS):02x}" for a, b in zip(ink, paper, strict=True))
        for k in range(_STEPS + 1)
    ]
    return " ".join(f"--grey-{k}: #{colour};" for k, colour in enumerate(mixed))
