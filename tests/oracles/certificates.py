"""Certificates of periodic orbits for the tests of the verifier, made without the prover.

The points of an orbit in floats are refined by Newton's method with the verifier's own flow, taken at midpoints. What
this module writes need not be right: whatever it writes, the verifier has to prove.
"""

import hashlib
import json
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, arb_mat, arb_poly, ctx, fmpq
from scipy.linalg import solve_discrete_lyapunov

from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness
from gearchaos.proof import verifier
from tests.oracles.march import error_at

SUPPORTS = ("mu1", "mu2", "kappa1", "kappa2", "zeta_support1", "zeta_support2")


def model_fields(model: MeshModel) -> dict[str, Any]:
    names = [*verifier.PLAIN, *(SUPPORTS if model.kind == "full" else ())]
    s = model.stiffness
    if isinstance(s, SteppedStiffness):
        stiffness = {"form": "stepped", "levels": strings(s.levels), "starts": strings(s.starts)}
    elif isinstance(s, HarmonicStiffness):
        stiffness = {"form": "fourier", "c": strings(s.amplitudes), "alpha": strings(s.phases)}
    else:
        stiffness = {"form": "two-level", **{n: getattr(s, n).hex() for n in ("chi1", "chi2", "contact_ratio")}}
    return {
        "kind": model.kind, **{n: float(getattr(model, n)).hex() for n in names},
        "eps": strings(model.error.amplitudes), "theta": strings(model.error.phases), "stiffness": stiffness}


def strings(values: Any) -> list[str]:
    return [float(v).hex() for v in values]


def reduced(model: MeshModel, physical: dict[str, float], names: list[str]) -> list[float]:
    """The verifier's coordinates of a physical state at phase 0."""
    if model.kind == "single":
        return [physical["z"], physical["z_dot"]]
    p = {"y1": 0.0, "y1_dot": 0.0, "y2": 0.0, "y2_dot": 0.0, **physical}
    error, error_dot = error_at(model, 0.0)
    values = {
        "z": p["x1"] - p["x2"] + p["y1"] - p["y2"] - error, "y": p["y1"] - p["y2"], "y_dot": p["y1_dot"] - p["y2_dot"],
        "z_dot": p["x1_dot"] - p["x2_dot"] + p["y1_dot"] - p["y2_dot"] - error_dot, **p}
    return [values[name] for name in names]


class Flow:
    """The flow of a mesh at midpoints: image, slopes and switches, which are found by bisection of time."""

    def __init__(self, mesh: verifier.Mesh, phase: fmpq) -> None:
        self.mesh, self.phase = mesh, phase

    def state(self, sigma: int, s: fmpq, h: fmpq, G: arb_mat) -> arb_mat:
        return (self.mesh.series(s + self.phase, h, sigma)[1] * G).mid()

    def period(self, w: list[arb]) -> tuple[arb_mat, list[tuple[fmpq, arb_mat, int, str]]]:
        """The matrix [[slopes, state], [0, 1]] after one period; (time, matrix, flank, into) of each switch."""
        d, switches = self.mesh.d, []
        G = arb_mat([[int(i == j) for j in range(d)] + [[*w, 1][i]] for i in range(d + 1)])
        sigma = round(float(G[0, d] > 1) - float(G[0, d] < -1))
        jumps = {v - v.floor() for v in (start - self.phase for start, _ in self.mesh.levels)}
        grid = sorted({fmpq(i, 64) for i in range(65)} | jumps)
        for s, end in pairwise(grid):
            while s < end:
                h = self.until(sigma, s, end - s, G)
                G, s = self.state(sigma, s, h, G), s + h
                if s < end:
                    flank = sigma or (1 if G[0, d] > 0 else -1)
                    switches.append((s, G, flank, "free" if sigma else "contact"))
                    sigma = 0 if sigma else flank
        return G, switches

    def until(self, sigma: int, s: fmpq, h: fmpq, G: arb_mat) -> fmpq:
        """h, or the time of the first switch before."""
        U, *_ = self.mesh.series(s + self.phase, h, sigma)
        z = arb_poly([(u * G)[0, self.mesh.d].mid() for u in U])

        def outside(t: fmpq) -> bool:
            return not (z(arb(t)) * sigma > 1 if sigma else abs(z(arb(t))) < 1)

        found = next((t for t in (h * i / 4 for i in range(1, 5)) if outside(t)), None)
        if found is None:
            return h
        low, high = h / 10**6, found  # the motion may begin on the boundary itself
        while high - low > h / fmpq(2) ** (ctx.prec // 3):
            middle = (low + high) / 2
            low, high = (low, middle) if outside(middle) else (middle, high)
        return low


def certificate(model: MeshModel, points: dict[str, np.ndarray], radius: str, bits: int = 128, phase: str = "0",
                share: float = 0.5) -> dict[str, Any]:
    """The certificate of the orbit near stroboscopic points (at phase 0) by physical coordinate."""
    with ctx.workprec(2 * bits):
        mesh = verifier.Mesh(model_fields(model))
        n = len(next(iter(points.values())))
        starts = [reduced(model, {k: float(v[i]) for k, v in points.items()}, mesh.names) for i in range(n)]
        flow = Flow(mesh, fmpq(0))
        w = [[arb(x) for x in start] for start in starts]
        shift = verifier.read(phase, verifier.NUMBER, "number")
        if shift:
            w = [_shifted(flow, x, shift) for x in w]
            flow = Flow(mesh, shift)
        w, images = _refined(flow, w)
        return _written(model, mesh, flow, w, images, radius, bits, phase, share)


def _shifted(flow: Flow, w: list[arb], shift: fmpq) -> list[arb]:
    """A rough state at a later phase, by the frozen flow in small steps."""
    d, steps = flow.mesh.d, 400
    G = arb_mat(d + 1, d + 1, [0] * (d + 1) ** 2)
    for i, x in enumerate([*w, arb(1)]):
        G[i, d] = x
    for i in range(steps):
        z = G[0, d]
        G = flow.state(1 if z > 1 else -1 if z < -1 else 0, shift * i / steps, shift / steps, G)
    return [G[i, d] for i in range(d)]


def _refined(flow: Flow, w: list[list[arb]]) -> tuple[list[list[arb]], list[Any]]:
    n, d = len(w), flow.mesh.d
    for _ in range(12):
        images = [flow.period(x) for x in w]
        residual = [images[k][0][i, d] - w[(k + 1) % n][i] for k in range(n) for i in range(d)]
        size = max(float(abs(x).upper()) for x in residual)
        if size < 2.0 ** (-ctx.prec * 0.6):
            return w, images
        J = np.zeros((n * d, n * d))
        for k, (G, _) in enumerate(images):
            J[k * d : k * d + d, k * d : k * d + d] = [[float(G[i, j]) for j in range(d)] for i in range(d)]
            for i in range(d):
                J[k * d + i, (k + 1) % n * d + i] -= 1
        step = [arb(x) for x in np.linalg.solve(J, [float(x / size) for x in residual])]
        w = [[(w[k][i] - step[k * d + i] * size).mid() for i in range(d)] for k in range(n)]
    raise ArithmeticError(f"not converged: {size}")


def windows(mesh: verifier.Mesh, found: list[tuple[fmpq, arb_mat, int, str]], r: float, bits: int) -> list[dict]:
    """Time windows four times as wide as the spread of a cube's switches."""
    out = []
    for time, G, flank, into in found:
        reach = r * sum(abs(float(G[0, j])) for j in range(mesh.d)) / abs(float(G[1, mesh.d] * mesh.T))
        out.append({"time": [dyadic(arb(time), bits), (4 * reach).hex()], "flank": flank, "into": into})
    return out


def _written(model: MeshModel, mesh: verifier.Mesh, flow: Flow, w: list[list[arb]], images: list[Any], radius: str,
             bits: int, phase: str, share: float) -> dict[str, Any]:
    n, d, r = len(w), mesh.d, float(arb(verifier.read(radius, verifier.NUMBER, "radius")))
    switches = [windows(mesh, found, r, bits) for _, found in images]
    S = [np.array([[float(G[i, j]) for j in range(d)] for i in range(d)]) for G, _ in images]
    Q = stein(S)
    inside = int(np.sum(np.linalg.eigvalsh(Q[0]) > 0))
    out = {
        "format": "gearchaos certificate", "version": 1, "theorem": "made for tests", "model": model_fields(model),
        "coordinates": mesh.names, "phase": phase, "period": n, "points": [[dyadic(x, bits) for x in p] for p in w],
        "radius": radius, "bits": bits, "switches": switches,
        "stability": {"inside": inside, "outside": d - inside, "Q": [[strings(row) for row in q] for q in Q]},
        "margins": dict.fromkeys(verifier.CERTIFICATE["margins"], "1e-300") | ({"separation": None} if n == 1 else {}),
        "versions": dict.fromkeys(["python", "gearchaos", "python-flint", "numpy"], "0")}
    own = verifier.verify(sealed(out)).margins
    if share and own:
        out["margins"] = {k: None if v is None else (share * v).hex() for k, v in own.items()}
    return sealed(out)


def stein(S: list[np.ndarray]) -> list[np.ndarray]:
    """Solutions Q_k of Q_k − S_k^T Q_(k+1) S_k = 1 around the cycle."""
    d = len(S[0])
    M, W = np.eye(d), np.zeros((d, d))
    for s in S:
        W, M = W + M.T @ M, s @ M
    Q = [solve_discrete_lyapunov(M.T, W)]
    for s in S[:0:-1]:
        Q.insert(0, np.eye(d) + s.T @ Q[0] @ s)
    Q.insert(0, Q.pop())
    return [(q + q.T) / 2 for q in Q]


def dyadic(x: arb, bits: int) -> str:
    """A hexadecimal string of about `bits` bits after the point."""
    whole = int((x * arb(2) ** bits + arb(0.5)).mid().floor().unique_fmpz())
    return f"{'-' if whole < 0 else ''}0x{abs(whole):x}p{-bits}"


def sealed(certificate: dict[str, Any], words: bool = True) -> dict[str, Any]:
    """With the words that belong to its contents, if it has any form, and with its checksum."""
    rest = {k: v for k, v in certificate.items() if k != "sha256"}
    with suppress(verifier.Refused, LookupError, TypeError, ArithmeticError, ValueError):
        rest |= {"theorem": verifier.sealed(certificate)["theorem"]} if words else {}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"))
    return {**rest, "sha256": hashlib.sha256(text.encode()).hexdigest()}
