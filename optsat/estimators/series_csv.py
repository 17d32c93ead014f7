"""Series as CSV: one row per epoch, ready for a spreadsheet."""

import csv
import io

import numpy as np

from optsat.estimators.attitude_series import AttitudeSeries

HEADER = (
    "t [s]",
    "q_BN.x [-]",
    "q_BN.y [-]",
    "q_BN.z [-]",
    "q_BN.w [-]",
    "bound [deg]",
    "status",
    "pairs",
    "rejected",
)


def series_csv(series: AttitudeSeries) -> str:
    """Return the text; an epoch that is not determined has neither attitude nor bound, rejected channels join by '+'.

    Numbers carry all digits, so that they are read back exactly.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEADER)
    bound_deg = np.degrees(series.bound_rad)
    for k, (t, ok) in enumerate(zip(series.t.tolist(), series.ok.tolist(), strict=True)):
        attitude = [*series.q_BN[k].tolist(), bound_deg[k].item()] if ok else [""] * 5
        index = int(series.status_index[k])
        status = series.statuses[index].value if index >= 0 else "no measurement"
        rejected = "+".join(name for name, out in zip(series.channels, series.rejected[k], strict=True) if out)
        table.writerow([t, *attitude, status, int(series.used[k]), rejected])
    return text.getvalue()
