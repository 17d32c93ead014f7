"""Status: what a kernel returns beside its results."""

from enum import IntEnum


class Status(IntEnum):
    """The values of `os_status_t`, fixed for ever."""

    OK = 0
    NULL = 1
    NOT_FINITE = 2
    NOT_UNIT = 3
    RANGE = 4
    OUTPUT = 5
    NOT_CONVERGED = 6
    STATE = 7
