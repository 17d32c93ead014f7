"""`optsat verify`: does a certificate prove what it claims; no solver is imported."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, print_json
from optsat.errors import CertificateFormatError

if TYPE_CHECKING:
    from optsat.certificates.certificate import Certificate

_MOST_REJECTED = 20


def verify_command(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="CERTIFICATE.json", help="One certificate, or one a line in a .jsonl file.", show_default=False
        ),
    ],
    as_json: AsJson = False,
) -> None:
    """Rebuild the proof of each certificate from its own data. Exit code 1 when one is rejected."""
    findings = [_examined(line, certificate) for line, certificate in _read(file)]
    rejected = [finding for finding in findings if not finding["accepted"]]
    if as_json:
        counts = {"accepted": len(findings) - len(rejected), "rejected": len(rejected)}
        print_json({"file": str(file), **counts, "certificates": findings})
    elif len(findings) == 1:
        typer.echo(aligned(_in_words(findings[0])))
    else:
        typer.echo(f"{file}: {len(findings) - len(rejected)} certificates accepted, {len(rejected)} rejected")
        shown = rejected[:_MOST_REJECTED]
        typer.echo(
            "".join(f"line {one['line']} rejected: {one['reason']}. {one['claim']}\n" for one in shown), nl=False
        )
    if rejected:
        raise typer.Exit(1)


def _read(file: Path) -> "list[tuple[int, Certificate]]":
    from optsat.certificates.certificate_file import read_certificate

    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise CertificateFormatError(f"{file}: the certificate cannot be opened: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise CertificateFormatError(f"{file}: this is not text, so it is no certificate.") from None
    lines = text.splitlines() if file.suffix == ".jsonl" else [text]
    found = []
    for number, line in enumerate(lines, start=1):
        if line.strip():
            try:
                found.append((number, read_certificate(line)))
            except CertificateFormatError as error:
                where = f"{file}, line {number}" if len(lines) > 1 else str(file)
                raise CertificateFormatError(f"{where}: {error}") from None
    if not found:
        raise CertificateFormatError(f"{file}: there is no certificate in it.")
    return found


def _examined(line: int, certificate: "Certificate") -> dict[str, Any]:
    import numpy as np

    verdict = certificate.verify()
    try:
        with np.errstate(all="ignore"):
            margin = certificate.margin()
    except np.linalg.LinAlgError:
        # numbers from which no bound can be recomputed; the verdict says why
        margin = math.nan
    return {
        "line": line,
        "claim": certificate.claim,
        "accepted": verdict.accepted,
        "reason": verdict.reason,
        "margin": margin if math.isfinite(margin) else None,
    }


def _in_words(finding: dict[str, Any]) -> list[tuple[str, str]]:
    margin = finding["margin"]
    return [
        ("claim", finding["claim"]),
        ("verdict", f"{'accepted' if finding['accepted'] else 'REJECTED'}: {finding['reason']}"),
        ("margin", "none" if margin is None else f"{margin:.6g}"),
    ]
