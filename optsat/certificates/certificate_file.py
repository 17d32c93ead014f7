"""Certificate file: the certificate that a JSON text holds, whichever of the known kinds it is."""

import json

from optsat.certificates import attitude_certificate, worst_case_certificate
from optsat.certificates.certificate import Certificate
from optsat.errors import CertificateFormatError


def read_certificate(text: str) -> Certificate:
    """Return the certificate that `to_json` wrote.

    Raises
    ------
    CertificateFormatError : not JSON, an unknown format, a field missing, of the wrong type or shape.
    """
    try:
        content = json.loads(text)
    except ValueError as error:
        raise CertificateFormatError(f"The certificate is not JSON: {error}.") from None
    kind = content.get("format") if isinstance(content, dict) else None
    if kind == worst_case_certificate.FORMAT:
        return worst_case_certificate.WorstCaseCertificate.from_json(text)
    if kind == attitude_certificate.FORMAT:
        return attitude_certificate.AttitudeCertificate.from_json(text)
    raise CertificateFormatError(
        f"The certificate's `format` must be {attitude_certificate.FORMAT!r} or {worst_case_certificate.FORMAT!r}, "
        f"got {kind!r}."
    )
