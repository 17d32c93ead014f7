"""Headers: the C files beside this package as text, each once, what it includes before it."""

import re
from collections.abc import Sequence
from importlib import resources

_INCLUDE = re.compile(r'^#include "(os_\w+\.h)"\n', re.MULTILINE)


def included(text: str) -> list[str]:
    """Return the names of the `os_` headers that a C text includes."""
    return list(dict.fromkeys(_INCLUDE.findall(text)))


def without_includes(text: str) -> str:
    """Return the text without its `#include` lines of `os_` headers."""
    return _INCLUDE.sub("", text)


def header(name: str) -> str:
    """Return the text of one header of `optsat/kernels/c`."""
    return resources.files("optsat.kernels.c").joinpath(name).read_text(encoding="utf-8")


def headers_text(names: Sequence[str]) -> str:
    """Return the text of these headers, with no other `os_` header left to include."""
    texts: dict[str, str] = {}

    def take(name: str) -> None:
        if name in texts:
            return
        text = header(name)
        for other in included(text):
            take(other)
        texts[name] = without_includes(text)

    for name in names:
        take(name)
    return "\n".join(texts.values())
