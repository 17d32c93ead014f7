"""Bundle: all files of an export as texts."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import resources

from optsat.errors import InputError
from optsat.export.build_files import cmake_lists, makefile
from optsat.export.definition import Definition
from optsat.export.interface import Interface
from optsat.export.print_header import print_header
from optsat.export.print_selftest import allowed_difference, print_main, print_selftest
from optsat.export.print_source import print_source
from optsat.export.provenance import Measured, provenance
from optsat.export.target import Precision, Target
from optsat.export.vectors import Vector, draw_vectors
from optsat.kernels.float_constants import check_float_constants

OWN = ("os_guard.h", "os_adapt.h", "os_selftest.h")
"""Files of `optsat/export/c` that every export holds."""

_INCLUDE = re.compile(r'^#include "(os_\w+\.h)"', re.MULTILINE)


@dataclass(frozen=True)
class Bundle:
    """The kernels of an export, each with its interface, for one target and one precision."""

    definitions: tuple[Definition, ...]
    interfaces: tuple[Interface, ...]
    target: Target
    precision: Precision

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the kernels."""
        return tuple(definition.source.name for definition in self.definitions)

    @property
    def allowed(self) -> dict[str, float]:
        """Largest difference from Python that passes, by name of the kernel."""
        return {i.source.name: allowed_difference(i, self.precision) for i in self.interfaces}

    @cached_property
    def vectors(self) -> tuple[list[Vector], ...]:
        """The stored arguments and answers of each kernel."""
        limits = self.precision == "double"
        return tuple(
            draw_vectors(definition, interface, limits)
            for definition, interface in zip(self.definitions, self.interfaces, strict=True)
        )

    def texts(self, measured: Mapping[str, Measured]) -> dict[str, str]:
        """Return the text of every file by its name, with what was measured of each kernel, if anything."""
        found = {
            "selftest.c": print_main(self.names),
            "Makefile": makefile(self.names, self.target, self.precision),
            "CMakeLists.txt": cmake_lists(self.names, self.target, self.precision),
        }
        for definition, interface, vectors in zip(self.definitions, self.interfaces, self.vectors, strict=True):
            name = definition.source.name
            head = provenance(definition, interface, self.target, self.precision, measured.get(name, Measured()))
            source = print_source(interface, head)
            found[f"{name}.h"] = print_header(interface, head)
            found[f"{name}.c"] = _refusing_float(name, source)
            found[f"{name}_selftest.c"] = print_selftest(interface, vectors, self.precision)
        return found | self._runtime(found)

    def _runtime(self, found: Mapping[str, str]) -> dict[str, str]:
        headers = {name: _own(name) for name in OWN}
        for file in self.target.files:
            headers[file.rpartition("/")[2]] = _own(file)
        wanted = [name for text in (*found.values(), *headers.values()) for name in _INCLUDE.findall(text)]
        while wanted:
            name = wanted.pop()
            if name not in headers:
                headers[name] = resources.files("optsat.kernels.c").joinpath(name).read_text(encoding="utf-8")
                wanted += _INCLUDE.findall(headers[name])
        return headers


def _own(file: str) -> str:
    return resources.files("optsat.export").joinpath("c", *file.split("/")).read_text(encoding="utf-8")


def _refusing_float(name: str, source: str) -> str:
    # a constant that became 0 would take a guard with it without a word
    try:
        check_float_constants(name, source)
    except InputError as error:
        refusal = f'#ifdef OS_REAL_IS_FLOAT\n#error "{_quoted(str(error))}"\n#endif'
        first = source.index('#include "os_guard.h"')
        return f"{source[:first]}{refusal}\n\n{source[first:]}"
    return source


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', "'")
