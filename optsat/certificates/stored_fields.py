"""Stored fields: what a certificate file holds, each field checked for type and shape as it is read."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import CertificateFormatError


@dataclass(frozen=True)
class StoredFields:
    """Typed access to a JSON object, so that a damaged file names its field."""

    content: dict[str, Any]
    prefix: str = ""

    @staticmethod
    def of(text: str, form: str) -> "StoredFields":
        """Return the fields of a JSON text whose `format` must be `form`.

        Raises
        ------
        CertificateFormatError : not JSON, or another format.
        """
        try:
            content = json.loads(text)
        except ValueError as error:
            raise CertificateFormatError(f"The certificate is not JSON: {error}.") from None
        if not isinstance(content, dict) or content.get("format") != form:
            raise CertificateFormatError(f"The certificate's `format` must be {form!r}.")
        return StoredFields(content)

    def mapping(self, name: str) -> dict[str, Any]:
        """Return an object."""
        value = self.content.get(name)
        if not isinstance(value, dict):
            raise CertificateFormatError(f"`{self.prefix}{name}` must be an object, got {type(value).__name__}.")
        return value

    def array(self, name: str, shape: tuple[int | None, ...]) -> Array:
        """Return finite numbers of a shape; None = any length."""
        if name not in self.content:
            raise CertificateFormatError(f"`{self.prefix}{name}` is missing.")
        try:
            array = np.array(self.content[name], dtype=np.float64)
        except (TypeError, ValueError):
            raise CertificateFormatError(f"`{self.prefix}{name}` must hold numbers.") from None
        if array.size == 0 and len(shape) == 2:
            array = array.reshape(0, shape[1] or 0)
        fits = array.ndim == len(shape) and all(
            want is None or want == got for want, got in zip(shape, array.shape, strict=True)
        )
        if not fits or not np.all(np.isfinite(array)):
            raise CertificateFormatError(
                f"`{self.prefix}{name}` must be finite numbers of shape {shape}, got {array.shape}."
            )
        return array
