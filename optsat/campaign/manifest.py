"""Manifest: what happened to a run, one checked line an event, only ever appended to."""

import json
import os
import zlib
from pathlib import Path
from typing import Any

from optsat.files import durable_step

Event = dict[str, Any]


class Manifest:
    """The history of a run folder; the chunk files themselves are the truth about what is finished."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> list[Event]:
        """Return the events up to the first line that is torn or changed."""
        return self._sound()[0]

    def repair(self) -> None:
        """Cut the file at the first line that is torn or changed."""
        length = self._sound()[1]
        if self.path.exists() and self.path.stat().st_size > length:
            with self.path.open("r+b") as stream:
                stream.truncate(length)
                os.fsync(stream.fileno())

    def append(self, event: str, **details: Any) -> None:
        """Add one event; when this returns it is on the disk."""
        text = json.dumps({"event": event, **details}, separators=(",", ":"), sort_keys=True).encode()
        line = b"%08x %s\n" % (zlib.crc32(text), text)
        with self.path.open("ab", buffering=0) as stream:
            stream.write(line[: len(line) // 2])
            durable_step()
            stream.write(line[len(line) // 2 :])
            durable_step()
            os.fsync(stream.fileno())
        durable_step()

    def _sound(self) -> tuple[list[Event], int]:
        events: list[Event] = []
        length = 0
        data = self.path.read_bytes() if self.path.exists() else b""
        for line in data.splitlines(keepends=True):
            checksum, _, text = line.rstrip(b"\n").partition(b" ")
            if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
                break
            events.append(json.loads(text))
            length += len(line)
        return events, length
