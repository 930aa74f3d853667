"""The page of the report: the values that its template needs, from a run."""

from __future__ import annotations

import base64
import os
import platform
import re
import struct
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from importlib import metadata
from importlib.resources import files
from io import BytesIO
from itertools import groupby
from typing import Any

import jinja2
import matplotlib
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from gearchaos.model import MeshModel
from gearchaos.paper.claims import MISSING, Claim, failed
from gearchaos.paper.claims._claim import CONTRADICTED, DIGITS, HOLDS, MISPRINT, VERDICTS
from gearchaos.paper.settings import FigureSettings, Quality, symbol

_LIBRARIES = ("gearchaos", "numpy", "numba", "scipy", "xarray", "matplotlib")

_ONE_BY_ONE = 3
"""Up to this number the motions of a statement are listed one by one; more are values of a scan, and share a line."""


@dataclass(frozen=True)
class FinishedFigure:
    """A figure with its settings, its picture as PNG, what was found, its data files, and the seconds that it took."""

    setting: FigureSettings
    png: bytes
    found: list[str]
    files: list[str]
    compute_seconds: float
    draw_seconds: float


def render(
    figures: Sequence[FinishedFigure], claims: Sequence[Claim], quality: Quality, check_seconds: float, seconds: float
) -> str:
    """The report as one self-contained HTML document; the seconds are those of the checks and of the whole run."""
    counts = Counter(c.verdict for c in claims)
    tally = [(verdict, counts[verdict]) for verdict in VERDICTS if counts[verdict]]
    minutes, rest = divmod(round(seconds), 60)
    run = {
        "gearchaos": metadata.version("gearchaos"), "date": date.today().isoformat(), "quality": quality.name,
        "cores": os.cpu_count(), "total": f"{minutes} min {rest} s" if minutes else f"{seconds:.1f} s",
    }
    times = [(f"Figure {f.setting.number}", f"{f.compute_seconds:.1f} s", f"{f.draw_seconds:.1f} s") for f in figures]
    if claims:
        times.append(("Statements", f"{check_seconds:.1f} s", ""))
    provenance = [
        ("quality", quality.name), ("zones", f"{quality.zones[0]} × {quality.zones[1]} cells"),
        ("basins", f"{quality.basins[0]} × {quality.basins[1]} initial states"),
        ("diagrams", f"{quality.bifurcation[0]} columns of {quality.bifurcation[1]} points"),
        ("portraits", f"{quality.portrait} points"), ("cores", str(os.cpu_count())), ("machine", platform.machine()),
        ("Python", platform.python_version()), *((name, metadata.version(name)) for name in _LIBRARIES),
    ]
    parts = [f"{count} {verdict if count == 1 else _PLURAL.get(verdict, verdict)}" for verdict, count in tally]
    wrong = failed(claims)
    outcome = f"Of {len(claims)} statements: {', '.join(parts)}. " + (
        f"Not confirmed: {', '.join(c.id for c in wrong)}." if wrong
        else "None is contradicted; the misprints are those known and listed below.")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: _text_of(f"templates/{name}")), autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["maths"] = _maths
    environment.filters["slug"] = lambda text: text.replace(" ", "-")
    environment.filters["capitalised"] = lambda text: text[:1].upper() + text[1:]
    return environment.get_template("report.html.j2").render(
        css=Markup(_text_of("templates/report.css")), figures=[_figure(f, claims) for f in figures],
        claims=[_claim(c) for c in claims], tally=tally, outcome=outcome,
        equations=_equations(), defaults=_defaults(), times=times,
        corrections=tomllib.loads(_text_of("corrections.toml"))["correction"],
        provenance=provenance, run=run, proofs=proofs_in_words(claims),
    )


def _text_of(name: str) -> str:
    return files("gearchaos.paper").joinpath(name).read_text(encoding="utf-8")


_INDEXED = re.compile(r"(?<!\w)([A-Za-zα-ω])(\d{1,2})(?!\w)|V_RMS")


def _maths(text: str) -> Markup:
    """Plain text as HTML, with the indices of symbols as subscripts: x1 becomes x<sub>1</sub>."""
    def lower(match: re.Match) -> str:
        head, index = (match[1], match[2]) if match[1] else ("V", "RMS")
        return f"{head}<sub>{index}</sub>"

    return Markup(_INDEXED.sub(lower, str(escape(text))))


def _figure(drawn: FinishedFigure, claims: Sequence[Claim]) -> dict[str, Any]:
    """What the template shows of one figure."""
    setting = drawn.setting
    width, height = struct.unpack(">II", drawn.png[16:24])  # the PNG header
    ranges: dict[tuple[str, str], dict[str, str]] = {}  # every one once, and whether it is given or assumed
    for study in setting.studies.values():
        for name, r in study.axes.items():
            text = f"{symbol(name)} from {r.start:g} to {r.stop:g}".replace("-", "−")
            ranges.setdefault((text, r.range), {"text": text, "range": r.range, "why": r.why})
    lines: dict[str, list[str]] = {}  # parameters as text, with the panels that share them
    for name, study in setting.studies.items():
        values = ", ".join(f"{symbol(k)} = {v}" for k, v in study.model.items() if k != "kind")
        panels = lines.setdefault(f"{study.model['kind']} model, {values}", [])
        if name[0] not in panels and len(name.split("_")[0]) == 1:
            panels.append(name[0])
    parameters = [(f"({', '.join(panels)}) " if len(lines) > 1 and panels else "") + text
                  for text, panels in lines.items()]
    return {
        "number": setting.number, "title": setting.title, "caption": setting.caption, "shows": setting.shows,
        "found": drawn.found, "files": drawn.files, "png": base64.b64encode(drawn.png).decode(),
        "width": width, "height": height, "settings": parameters, "ranges": list(ranges.values()),
        "claims": [c for c in claims if c.figure == setting.number],
    }


_PLURAL = {HOLDS: "hold", DIGITS: "hold within the printed digits", MISPRINT: "misprints"}


def _claim(claim: Claim) -> dict[str, Any]:
    """What the template shows of a claim, all of whose motions may be proved.

    Then ``mark`` stands beside the verdict: at how many values of a scan a period is proved, or "theorem" where the
    claim holds as printed or within its digits.
    """
    all_proved, mark = all(proof["proved"] for proof in claim.proofs), ""
    if all_proved and len(claim.proofs) > _ONE_BY_ONE:
        periods = sorted({proof["period"] for proof in claim.proofs})
        mark = f"{', '.join(f'{n}T' for n in periods)} proved at {len(claim.proofs)} values"
    elif all_proved and claim.proofs and claim.verdict not in (CONTRADICTED, MISPRINT):
        mark = "theorem"
    # what is proved, with the files, and what is not and why: a line for each motion, or for the values of a scan
    proofs = [proof for proof in claim.proofs if proof.get("reason") != MISSING]

    def shared(proof: dict[str, Any]) -> tuple[int, str]:  # by the values of a scan on one line
        return proof["period"], proof.get("reason", "")

    lines = [_proof_line([proof]) for proof in proofs] if len(proofs) <= _ONE_BY_ONE else [
        _proof_line(list(same)) for _, same in groupby(sorted(proofs, key=shared), key=shared)]
    return {
        **claim.to_dict(), "evidence": list(_flat(claim.evidence)), "proofs": lines,
        "mark": mark, "all_proved": all_proved,
    }


def proofs_in_words(claims: Sequence[Claim]) -> str:
    """How many periodic motions are proved, in a sentence; empty if there are none."""
    proofs = [proof for claim in claims for proof in claim.proofs]
    if not proofs:
        return ""
    if any(proof.get("reason") == MISSING for proof in proofs):
        return f'Periodic motions were not proved, since {MISSING} (pip install "gearchaos[proof]").'
    count = sum(proof["proved"] for proof in proofs)
    return f"Proved in ball arithmetic: {count} of {len(proofs)} periodic motions behind the statements."


def _proof_line(proofs: list[dict[str, Any]]) -> dict[str, str]:
    """The ``text`` and ``file`` of one motion, or of several that differ in the value of one parameter."""
    first, where = proofs[0], ""
    for name in first["at"]:
        values = [proof["at"][name] for proof in proofs]
        where = f" at {symbol(name)} = {values[0]:.8g}" if len(values) == 1 else (
            f" at {len(values)} of the values of {symbol(name)} computed, from {min(values):.8g} to {max(values):.8g}")
    text = f"{first['period']}T{where}"
    if not first["proved"]:
        return {"text": f"{text}: not proved, {first['reason']}", "file": ""}
    radius, bits = max(proof["radius"] for proof in proofs), max(proof["bits"] for proof in proofs)
    file = first["file"]
    if len(proofs) > 1:
        (name,) = first["at"]
        file = f"{file[: file.index(name)]}{name}-*.json"
    return {"text": f"{text}: radius {radius:g}, {bits} bits,", "file": file}


def _flat(evidence: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested evidence as pairs (name, value) of text."""
    for key, value in evidence.items():
        name = f"{prefix}{str(key).replace('_', ' ')}"
        if isinstance(value, Mapping) and any(isinstance(v, (Mapping, list)) for v in value.values()):
            yield from _flat(value, f"{name} · ")
        else:
            yield name, _text(value)


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{str(k).replace('_', ' ')} {_text(v)}" for k, v in value.items())
    if isinstance(value, list):
        inner = ("; " if any(isinstance(v, (list, Mapping)) for v in value) else ", ").join(map(_text, value))
        return inner or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _defaults() -> list[tuple[str, str, str]]:
    """Symbol, value and meaning of the default parameters of the models."""
    m = MeshModel(kind="full")
    s: Any = m.stiffness
    return [
        ("ζ", f"{m.zeta}", "mesh damping ratio"), ("χ1, χ2", f"{s.chi1}, {s.chi2}", "stiffness variation"),
        ("α", f"{s.contact_ratio}", "profile contact ratio"),
        ("β1, β2", f"{m.beta1}, {m.beta2}", "bearing friction (0 in the single model)"),
        ("J1, J2", f"{m.J1:g}, {m.J2:g}", "moments of inertia"),
        ("μ1, μ2", f"{m.mu1:g}, {m.mu2:g}", "masses (full model)"),
        ("ζ1, ζ2", f"{m.zeta_support1}, {m.zeta_support2}", "support damping ratios (full model)"),
        ("θ1", "0", "phase of the transmission error"), ("q1 = q2 = q0", "by figure", "static torques"),
    ]


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
def _equations() -> list[dict[str, Any]]:
    """Number, alternative text, SVG (base64) and width in em of every equation.

    They are typeset by matplotlib, so that they look the same in every browser.
    """
    out = []
    for number, alt_text, rows in _EQUATIONS:
        with matplotlib.rc_context(_STYLE):
            figure, buffer = Figure(figsize=(9, 4)), BytesIO()
            if len(rows) == 1:
                figure.text(0.1, 0.5, f"${' '.join(rows[0])}$", fontsize=_SIZE)
            else:  # aligned where the left parts end
                for i, (left, right) in enumerate(rows):
                    y = 0.9 - i * _LINE / 4
                    figure.text(0.5, y, f"${left}$", ha="right", fontsize=_SIZE)
                    figure.text(0.506, y, f"${right}$", ha="left", fontsize=_SIZE)
            figure.savefig(buffer, format="svg", bbox_inches="tight", pad_inches=0.02, transparent=True,
                           metadata={"Date": None})
        svg = buffer.getvalue().decode()
        points = float(svg.split('width="', 1)[1].split("pt", 1)[0])
        out.append({"number": number, "alt_text": alt_text, "width": round(points / _SIZE, 2),
                    "svg": base64.b64encode(svg.encode()).decode()})
    return out
