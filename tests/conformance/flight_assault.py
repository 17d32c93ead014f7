"""Assault: a C programme that calls a guarded kernel, plausibly and with hostile arguments, and judges each answer."""

import math
from collections.abc import Sequence

from optsat.export.interface import Interface
from optsat.port import Port


def print_assault(interface: Interface) -> str:
    """The programme: argument 1 counts the plausible calls, argument 2 the hostile ones; prints counts."""
    name = interface.source.name
    ports = [*interface.source.inputs, *interface.source.outputs, *interface.state]
    unique = {(_kind(interface, port), port.name): port for port in ports}
    checks = [_check(kind, port) for (kind, _), port in unique.items()]
    return "\n".join(
        [
            f'#include <stdlib.h>\n#include "{name}.h"\n#include "flight_assault.h"\n',
            *checks,
            *_safe(interface.source.outputs),
            "",
            *(_stateful(interface) if interface.state else _stateless(interface)),
        ]
    )


def _kind(interface: Interface, port: Port) -> str:
    return "result" if port in interface.source.outputs else "argument"


def _number(value: float | None, otherwise: float) -> str:
    value = otherwise if value is None else value
    return f"{'-' if value < 0 else ''}(double)INFINITY" if math.isinf(value) else repr(value)


def _check(kind: str, port: Port) -> str:
    fields = [
        f"{port.size}U",
        f"{port.row_length}U",
        _number(port.unit_norm, -1.0),
        _number(port.lower, -math.inf),
        _number(port.upper, math.inf),
        str(int(port.positive_definite)),
        str(int(port.direction is not None)),
    ]
    return f"static const check_t {kind}_{port.name} = {{{', '.join(fields)}}};"


def _safe(ports: Sequence[Port]) -> list[str]:
    return [
        f"static const os_real_t safe_{port.name}[{port.size}] = "
        f"{{{', '.join(f'(os_real_t){value!r}' for value in port.safe_values)}}};"
        for port in ports
    ]


def _pointer(structure: str, port: Port) -> str:
    return f"{structure}.{port.name}" if port.shape else f"&{structure}.{port.name}"


def _same(structure: str, port: Port, other: str) -> str:
    return f"memcmp({_pointer(structure, port)}, {other}, sizeof(os_real_t) * {port.size}U) == 0"


def _stateless(interface: Interface) -> list[str]:
    name = interface.source.name
    memory = ", lost == 3U ? NULL : &memory" if interface.has_work else ""
    lines = [
        "static unsigned long assault(uint32_t wild, unsigned long calls)",
        "{",
        "    unsigned long accepted = 0U;",
        *([f"    static {name}_memory_t memory;"] if interface.has_work else []),
        "    for (unsigned long call = 0U; call < calls; call++) {",
        f"        {name}_in_t in;",
        f"        {name}_out_t out;",
        "        const uint32_t lost = (wild != 0U && drawn() % 100U == 0U) ? (uint32_t)(drawn() % 4U) : 0U;",
        "        memset(&out, 0x55, sizeof out);",
        *_fills(interface, "in", interface.arguments),
        f"        const os_status_t status = {name}(lost == 1U ? NULL : &in, lost == 2U ? NULL : &out{memory});",
    ]
    lines += [_TOLD]
    if interface.has_work:
        lines += ['        must((lost != 0U) == (status == OS_E_NULL), "a missing pointer is told");']
    else:
        lines += ['        must((lost == 1U || lost == 2U) == (status == OS_E_NULL), "a missing pointer is told");']
    lines += [
        "        if (status == OS_OK) {",
        "            accepted++;",
        *_good(interface),
        "        } else if (lost != 2U) {",
    ]
    for port in interface.source.outputs:
        lines += [f'            must({_same("out", port, f"safe_{port.name}")}, "safe {port.name}");']
    return [*lines, "        }", "    }", "    return accepted;", "}", "", *_main()]


def _stateful(interface: Interface) -> list[str]:
    name = interface.source.name
    memory = ", &memory" if interface.has_work else ""
    lines = [
        "static unsigned long assault(uint32_t wild, unsigned long calls)",
        "{",
        "    unsigned long accepted = 0U;",
        f"    {name}_state_t state;",
        *([f"    static {name}_memory_t memory;"] if interface.has_work else []),
        "    int is_set = 0;",
        "    memset(&state, 0x55, sizeof state);",
        "    for (unsigned long call = 0U; call < calls; call++) {",
        f"        {name}_cfg_t cfg;",
        f"        {name}_in_t in;",
        f"        {name}_out_t out;",
        "        const uint32_t lost = (wild != 0U && drawn() % 100U == 0U) ? (uint32_t)(drawn() % 4U) : 0U;",
        "        memset(&out, 0x55, sizeof out);",
        "        if (call > 2U && drawn() % 8U == 0U) {",
        *(
            f"            fill({_pointer('cfg', p)}, &{_kind(interface, p)}_{p.name}, wild * 8U);"
            for p in interface.state
        ),
        f"            is_set = {interface.initial}(&state, drawn() % 50U == 0U ? NULL : &cfg) == OS_OK;",
        "        }",
        "        if (wild != 0U && drawn() % 64U == 0U) {",
        "            ((unsigned char *)&state)[drawn() % sizeof state] ^= (unsigned char)(1U << (drawn() % 8U));",
        "            is_set = is_set != 0 ? 2 : 0;",
        "        }",
        f"        {name}_state_t before;",
        "        memcpy(&before, &state, sizeof state);",
        *_fills(interface, "in", interface.arguments),
        f"        const os_status_t status = {interface.function}(lost == 3U ? NULL : &state, lost == 1U ? NULL : &in, "
        f"lost == 2U ? NULL : &out{memory});",
        '        must((lost != 0U) == (status == OS_E_NULL), "a missing pointer is told");',
        '        must(is_set != 0 || status == OS_E_NULL || status == OS_E_STATE, "a state never set is told");',
        _TOLD,
        "        int bad_state = 0;",
        *(
            f"        bad_state |= is_bad({_pointer('before', p)}, &{_kind(interface, p)}_{p.name});"
            for p in interface.state
        ),
        '        must(bad_state == 0 || status == OS_E_NULL || status == OS_E_STATE, "a bad state is told");',
        "        if (status == OS_OK) {",
        "            accepted++;",
        *_good(interface),
        *(
            f'            must({_same("out", p, _pointer("state", p))}, "state {p.name} follows");'
            for p in interface.state
        ),
        "        } else {",
        '            must(memcmp(&before, &state, sizeof state) == 0, "the state is untouched");',
        "        }",
        "        if (status != OS_OK && lost != 2U) {",
    ]
    for port in interface.source.outputs:
        safe = _same("out", port, f"safe_{port.name}")
        if port.name in {each.name for each in interface.state}:
            kept = _same("out", port, _pointer("before", port))
            lines += [
                f"            must(is_set == 1 && lost != 3U ? {kept} : ({kept} && bad_state == 0) || {safe}, "
                f'"last or safe {port.name}");'
            ]
        else:
            lines += [f'            must({safe}, "safe {port.name}");']
    return [*lines, "        }", "    }", "    return accepted;", "}", "", *_main()]


def _fills(interface: Interface, structure: str, ports: Sequence[Port]) -> list[str]:
    lines = [f"        fill({_pointer(structure, p)}, &{_kind(interface, p)}_{p.name}, wild);" for p in ports]
    if interface.counted:
        rows = interface.counted[0].shape[0]
        wild, tame = f"drawn() % {rows + 3}U", f"1U + drawn() % {rows}U"
        lines += [f"        {structure}.count = (uint32_t)(wild != 0U ? {wild} : {tame});"]
    return [*lines, *_not_finite(structure, ports)]


def _not_finite(structure: str, ports: Sequence[Port]) -> list[str]:
    """Whether an entry that is read is not finite; all rows are where the count is out of range."""
    lines = ["        int not_finite = 0;"]
    for port in ports:
        size = f"{port.size}U"
        if port.counted:
            rows, row = port.shape[0], port.size // port.shape[0]
            valid = f"({structure}.count >= 1U && {structure}.count <= {rows}U)"
            size = f"({valid} ? {structure}.count * {row}U : {size})"
        pointer = f"({_pointer(structure, port)})"
        lines += [f"        for (uint32_t k = 0U; k < {size}; k++) {{ not_finite |= !is_finite({pointer}[k]); }}"]
    return lines


_TOLD = """\
        if (lost == 0U && status != OS_E_STATE) {
            must((status == OS_E_NOT_FINITE) == (not_finite != 0), "an argument that is not finite is told, no other");
        }"""


def _good(interface: Interface) -> list[str]:
    """Of an accepted call: arguments that were good, as far as they are read, and results that are."""
    lines = []
    for port in interface.arguments:
        check = f"{_kind(interface, port)}_{port.name}"
        if port.counted:
            lines += [
                f"            check_t read_{port.name} = {check};",
                f"            read_{port.name}.size = in.count * {port.size // port.shape[0]}U;",
                f'            must(in.count >= 1U && in.count <= {port.shape[0]}U, "count in range");',
            ]
            check = f"read_{port.name}"
        lines += [f'            must(!is_bad({_pointer("in", port)}, &{check}), "good {port.name} of arguments");']
    for port in interface.source.outputs:
        lines += [
            f'            must(!is_bad({_pointer("out", port)}, &result_{port.name}), "good {port.name} of results");'
        ]
    return lines


def _main() -> list[str]:
    return [
        "int main(int argc, char **argv)",
        "{",
        "    const unsigned long plausible = argc > 1 ? strtoul(argv[1], NULL, 10) : 0U;",
        "    const unsigned long hostile = argc > 2 ? strtoul(argv[2], NULL, 10) : 0U;",
        "    const unsigned long accepted = assault(0U, plausible);",
        "    const unsigned long let_through = assault(3U, hostile / 2U) + assault(30U, hostile - hostile / 2U);",
        '    printf("plausible %lu accepted %lu hostile %lu accepted %lu violations %lu\\n",',
        "           plausible, accepted, hostile, let_through, violations);",
        "    return violations != 0U;",
        "}",
        "",
    ]
