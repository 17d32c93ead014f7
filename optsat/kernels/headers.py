"""Headers: the C files beside this package as text, each once, what it includes before it."""

import re
from collections.abc import Sequence
from importlib import resources

_INCLUDE = re.compile(r'^#include "(os_\w+\.h)"\n', re.MULTILINE)


def headers_text(names: Sequence[str]) -> str:
    """Return the text of these headers of `optsat/kernels/c`, with no other `os_` header left to include."""
    texts: dict[str, str] = {}

    def take(name: str) -> None:
        if name in texts:
            return
        text = resources.files("optsat.kernels.c").joinpath(name).read_text(encoding="utf-8")
        for other in _INCLUDE.findall(text):
            take(other)
        texts[name] = _INCLUDE.sub("", text)

    for name in names:
        take(name)
    return "\n".join(texts.values())
