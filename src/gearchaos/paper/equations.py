"""The equations of the model, typeset by matplotlib so that they look the same in every browser."""

from __future__ import annotations

import base64
from functools import cache
from io import BytesIO
from typing import Any

import matplotlib
from matplotlib.figure import Figure

_EQUATIONS: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...] = (
    ("(2.12)", "the four equations of motion", (
        (r"J_1\ddot{x}_1 + 2\beta_1\dot{x}_1 + 2\zeta\dot{z} + \chi(\tau)f(z)", r"= q_1"),
        (r"J_2\ddot{x}_2 + 2\beta_2\dot{x}_2 - 2\zeta\dot{z} - \chi(\tau)f(z)", r"= -q_2"),
        (r"\mu_1\ddot{y}_1 + 2\mu_1\zeta_1\dot{y}_1 + \kappa_1y_1 + 2\zeta\dot{z} + \chi(\tau)f(z)", r"= 0"),
        (r"\mu_2\ddot{y}_2 + 2\mu_2\zeta_2\dot{y}_2 + \kappa_2y_2 - 2\zeta\dot{z} - \chi(\tau)f(z)", r"= 0"),
    )),
    ("(2.14)", "relative displacement", ((r"z", r"= x_1 - x_2 + y_1 - y_2 - \varepsilon(\tau)"),)),
    ("(2.15)", "transmission error", (
        (r"\varepsilon(\tau)", r"= \sum_{j}\,\varepsilon_j\,\cos(j\omega\tau - \theta_j)"),
    )),
    ("(2.13)", "backlash", (
        (r"f(z)", r"= z - 1\quad(z > 1),\qquad 0\quad(|z| \leq 1),\qquad z + 1\quad(z < -1)"),
    )),
    ("(2.16)", "mesh stiffness", (
        (r"\chi(\tau)", r"= 1 + \chi_1\quad(0 \leq \tau < (\alpha - 1)T),\qquad "
                        r"1 - \chi_2\quad((\alpha - 1)T \leq \tau < T),\qquad T = 2\pi/\omega"),
    )),
    ("(2.17)", "the single equation", (
        (r"\ddot{z} + 2\zeta_0\dot{z} + \chi_0(\tau)f(z)", r"= q_0 - \ddot{\varepsilon}(\tau)"),
    )),
)
_SIZE, _LINE = 12.0, 0.30
_STYLE: Any = {"mathtext.fontset": "stix", "svg.fonttype": "path", "svg.hashsalt": "gearchaos"}


@cache
def equations() -> list[dict[str, Any]]:
    """Number, alternative text, SVG (base64) and width in em of every equation."""
    out = []
    for number, alt_text, rows in _EQUATIONS:
        svg = _svg(rows)
        points = float(svg.split('width="', 1)[1].split("pt", 1)[0])
        out.append({"number": number, "alt_text": alt_text, "width": round(points / _SIZE, 2),
                    "svg": base64.b64encode(svg.encode()).decode()})
    return out


def _svg(rows: tuple[tuple[str, str], ...]) -> str:
    """SVG of an equation of rows (left, right); several rows are aligned where the left parts end."""
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(9, 4))
        if len(rows) == 1:
            figure.text(0.1, 0.5, f"${' '.join(rows[0])}$", fontsize=_SIZE)
        else:
            for i, (left, right) in enumerate(rows):
                y = 0.9 - i * _LINE / 4
                figure.text(0.5, y, f"${left}$", ha="right", fontsize=_SIZE)
                figure.text(0.506, y, f"${right}$", ha="left", fontsize=_SIZE)
        buffer = BytesIO()
        figure.savefig(
            buffer, format="svg", bbox_inches="tight", pad_inches=0.02, transparent=True, metadata={"Date": None}
        )
    return buffer.getvalue().decode()
