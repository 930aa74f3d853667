"""Check certificates about a gear mesh: `python verifier.py FILE...`; exit status 0 if all are proved.

The certificate of an orbit claims: in the coordinates listed the model has exactly one orbit of period n mesh periods
whose states at τ = (k + phase) T lie in the cubes X_k of half edge r about the points c_k; it repeats after no fewer
mesh periods; contact switches once in each time window listed and at no other time; i of its d multipliers lie inside
the unit circle, d − i outside. That of a chaotic set: parallelograms cover each other under the map over a mesh period
(see `covered`). Nothing in a file is believed: the equations are integrated anew in ball arithmetic (python-flint),
where results are intervals that contain the exact ones, and a comparison is true only if it is for all elements. So the
claim holds if all `require` pass. The theorem in words is made from values that are read by the closed tables below,
and the file must state the same words.

Equations (Łuczko 2008, (2.12)-(2.18), corrected), with z = x1 − x2 + y1 − y2 − ε(τ), f(z) = z − clamp(z, −1, 1):
    J1 x1'' + 2 β1 x1' + S =  q1        μ1 y1'' + 2 μ1 ζ1 y1' + κ1 y1 + S = 0        S = 2 ζ z' + χ(τ) f(z)
    J2 x2'' + 2 β2 x2' − S = −q2        μ2 y2'' + 2 μ2 ζ2 y2' + κ2 y2 − S = 0
`full` has all four, `torsional` the left two (y = 0), `single` these with β = 0. As x1' = z' + x2' − y1' + y2' + ε',
    z'' = q1/J1 + q2/J2 − 2 β1/J1 (z' + x2' − y1' + y2' + ε') + 2 β2/J2 x2' − 2 ζ1 y1' − κ1/μ1 y1 + 2 ζ2 y2'
          + κ2/μ2 y2 − (1/J1 + 1/J2 + 1/μ1 + 1/μ2) S − ε''.
x2' drops out if β1/J1 = β2/J2; if κ1/μ1 = κ2/μ2 and ζ1 = ζ2, y = y1 − y2 takes the place of y1 and y2. Time counts
mesh periods: s = τ/T, T = 2π/ω, u = s + phase. The state w, w[0] = z, w[1] = z', with the constant 1 appended, solves
    dw/ds = M w + a(u) e1 − b χ(u) f(w[0]),   a = −T (ε'' + 2 β1/J1 ε'),   constant terms in the last column of M.  (1)
"""
import hashlib
import json
import re
import sys
from functools import lru_cache, reduce
from itertools import accumulate, combinations, pairwise
from pathlib import Path
from typing import Any, NamedTuple

from flint import arb, arb_mat, arb_poly, ctx, fmpq, fmpq_mat

NUMBER = (re.compile(r"(-?)0x([0-9a-f]+)(?:\.([0-9a-f]+))?p([+-]?[0-9]{1,5})"),
          re.compile(r"(-?)([0-9]+)(?:\.([0-9]+))?(?:e([+-]?[0-9]{1,5}))?"))
PLAIN = dict.fromkeys(["omega", "zeta", "J1", "J2", "q1", "q2", "beta1", "beta2"], NUMBER)
SUPPORTS = dict.fromkeys(["mu1", "mu2", "kappa1", "kappa2", "zeta_support1", "zeta_support2"], NUMBER)
STIFFNESS: dict[str, dict[str, Any]] = {"two-level": {"chi1": NUMBER, "chi2": NUMBER, "contact_ratio": NUMBER},
             "stepped": {"levels": [NUMBER], "starts": [NUMBER]}, "fourier": {"c": [NUMBER], "alpha": [NUMBER]}}
KIND = re.compile("single|torsional|full")
COMMON = {
    "format": str, "version": int, "theorem": str, "model": dict, "coordinates": [re.compile("(z|y|y1|y2|x2)(_dot)?")],
    "bits": int, "sha256": re.compile("[0-9a-f]{64}"),
    "versions": dict.fromkeys(["python", "gearchaos", "python-flint", "numpy"], re.compile("[0-9a-zA-Z.+!-]{1,64}"))}
SWITCH = {"time": [NUMBER], "flank": int, "into": re.compile("free|contact")}
CERTIFICATE = COMMON | {
    "phase": NUMBER, "period": int, "points": [[NUMBER]], "radius": NUMBER, "switches": [[SWITCH]],
    "stability": {"inside": int, "outside": int, "Q": [[[NUMBER]]]},
    "margins": dict.fromkeys(["existence", "separation", "contact", "stability"], (*NUMBER, None))}
CHAOTIC_SET = COMMON | {
    "tolerances": dict, "transitions": [[int]],
    "sets": [{"centre": [NUMBER], "unstable": [NUMBER], "stable": [NUMBER]}],
    "slack": NUMBER, "entropy": NUMBER, "weights": [NUMBER]}
FORMS: dict[str, dict[str, Any]] = {"gearchaos certificate": CERTIFICATE, "gearchaos chaotic set": CHAOTIC_SET}
NO_FORMS = {"gearchaos event certificate": "there is no verifier of events; those of the orbits at both ends can be "
            "checked: certificates() of the event", "gearchaos box certificate": "there is no verifier of boxes"}
SLACK, LEAST_STEP = fmpq(1, 100), fmpq(1, 2**18)
EXPONENTS, STEPS, BRANCHES = 2**24, 100_000, 64  # limits of this program's work

class Refused(Exception):  # noqa: N818  (an answer, not an error)
    """The certificate does not prove what it claims; the message says why."""

class Result(NamedTuple):
    """Outcome of a check, with the margins that this program has proved."""
    proved: bool
    lines: list[str]
    margins: dict[str, float | None]

def require(holds: Any, reason: str) -> None:
    if holds is not True:
        raise Refused(reason)

def read(value: Any, form: Any, name: str) -> Any:
    """`value` if it has the form of the table above, its number strings as the exact numbers that they mean."""
    if isinstance(form, dict):
        require(type(value) is dict, f"{name}: not an object")
        odd = [f"{key[:40]!r} {'missing' if key in form else 'unknown'}" for key in sorted(form.keys() ^ value.keys())]
        require(not odd, f"{name}: {', '.join(odd[:3])}" + f" and {len(odd) - 3} more" * (len(odd) > 3))
        return {key: read(value[key], form[key], f"{name}.{key}") for key in form}
    if isinstance(form, list):
        require(type(value) is list and len(value) <= 4096, f"{name}: not a list of at most 4096 entries")
        return [read(entry, form[0], f"{name}[{i}]") for i, entry in enumerate(value)]
    if isinstance(form, type):
        require(type(value) is form, f"{name}: not of the type {form.__name__}")
        return value
    if isinstance(form, re.Pattern):
        require(type(value) is str and form.fullmatch(value) is not None, f"{name}: not of the form {form.pattern}")
        return value
    if value is None and None in form:
        return None
    require(type(value) is str and len(value) <= 4000, f"{name}: not a number string of at most 4000 characters")
    found, base, digit = (form[0].fullmatch(value), 2, 4) if "x" in value else (form[1].fullmatch(value), 10, 1)
    require(found is not None and abs(int(found[4] or 0)) <= 9999, f"{name}: {value[:40]!r} is no number, or too large")
    part = found[3] or ""
    return fmpq(int(found[1] + found[2] + part, base**digit)) * fmpq(base) ** (int(found[4] or 0) - digit * len(part))

def kind_of(model: dict[str, Any]) -> str:
    return str(read(model.get("kind"), KIND, "model.kind"))

def largest(values: list[arb]) -> arb:
    """An upper bound of the moduli, NaN if one is (as of a quotient by an interval that contains 0): no test passes."""
    return reduce(arb.max, (v.abs_upper() for v in values), arb(0)).upper()

def ball(radius: arb) -> arb:  # [−radius, radius]
    return arb(0, radius.abs_upper())

class Waves:
    """g(u) = mean + Σ_j x_j (C_j cos(2πju − θ_j) + S_j sin(2πju − θ_j)), parts(j) = (C_j, S_j); θ left out are 0."""
    def __init__(self, mean: int, x: list[fmpq], theta: list[fmpq], parts: Any) -> None:
        require(len(theta) <= len(x) <= 64, "model: more than 64 harmonics, or more phases than amplitudes")
        self.mean, phases = arb(mean), theta + [fmpq(0)] * len(x)
        self.terms: list[Any] = [(j, *(v * c for c in parts(j)), phases[j - 1]) for j, v in enumerate(x, 1) if v != 0]

    def series(self, u: arb, count: int) -> list[arb]:
        """Taylor coefficients about u, a number or an interval; derivatives of a term go v, v', −v, −v', v, ..."""
        out = [self.mean] + [arb(0)] * (count - 1)
        for j, c, s, theta in self.terms:
            rate, factor = 2 * j * arb.pi(), arb(1)
            sin, cos = (rate * u - theta).sin_cos()
            v, slope = c * cos + s * sin, s * cos - c * sin
            for k in range(count):
                out[k] += factor * (v, slope, -v, -slope)[k % 4]
                factor = factor * rate / (k + 1)
        return out

    def bound(self, rho: arb) -> arb:
        """Of |g| at complex distance rho from any real u, where |cos|, |sin| are at most cosh of the imaginary part."""
        return sum(((abs(c) + abs(s)) * (2 * j * arb.pi() * rho).cosh() for j, c, s, _ in self.terms), abs(self.mean))

class Mesh:
    """Equation (1) of a model, in balls of the present precision. Before the constant 1 the state has an amplitude ε_j
    for each of `harmonics`, in addition to that of the model."""
    def __init__(self, model: dict[str, Any], harmonics: list[int] | None = None) -> None:
        kind, form = kind_of(model), read(model.get("stiffness"), dict, "model.stiffness").get("form")
        require(form in [*STIFFNESS], f"model.stiffness.form: not of the form {'|'.join(STIFFNESS)}")
        plain: dict[str, Any] = PLAIN | (SUPPORTS if kind == "full" else {})
        waves = {"eps": [NUMBER], "theta": [NUMBER], "stiffness": {"form": str} | STIFFNESS[form]}
        p = read(model, {"kind": str} | plain | waves, "model")
        for name in plain.keys() - {"q1", "q2"}:
            require(p[name] > 0 or (name[:4] in ("zeta", "beta") and p[name] == 0), f"model.{name}: must be positive")
        require(kind != "single" or p["beta1"] == p["beta2"] == 0, "model: a single model has beta1 = beta2 = 0")
        self.T, omega, drag = 2 * arb.pi() / p["omega"], p["omega"], 2 * p["beta1"] / p["J1"]
        size = max([len(p["eps"]), *(harmonics or [])])
        self.forces = [Waves(0, x, p["theta"], lambda j: (self.T * (j * omega) ** 2, self.T * drag * j * omega))
                       for x in [*([fmpq(i == j) for i in range(1, size + 1)] for j in harmonics or []), p["eps"]]]
        self.stiffness(p["stiffness"], form)
        self.linear(p)
        self.series, self.steps = lru_cache(256)(self.expand), 0

    def stiffness(self, p: dict[str, Any], form: str) -> None:
        """`levels`: (start, χ), each valid to the next start, the last also up to the first; or `wave`: Fourier."""
        self.levels: list[tuple[fmpq, fmpq]] = []
        if form == "two-level":
            end = p["contact_ratio"] - 1
            require(0 <= end <= 1, "stiffness.contact_ratio: must lie in [1, 2]")
            self.levels += [(fmpq(0), 1 + p["chi1"])] * (end > 0) + [(end, 1 - p["chi2"])] * (end < 1)
        elif form == "stepped":
            require(0 < len(p["levels"]) == len(p["starts"]) <= 64 and p["starts"][0] >= 0
                    and all(a < b for a, b in pairwise([*p["starts"], 1])), "stiffness: levels and starts do not fit")
            self.levels += zip(p["starts"], p["levels"], strict=True)
        else:
            self.wave = Waves(1, p["c"], p["alpha"], lambda j: (1, 0))

    def stiffness_range(self, u: fmpq, v: fmpq) -> arb:
        """An interval that contains χ on [u, v], jumps included; start + ⌈u − start⌉ is the first jump from u on."""
        if not self.levels:
            return self.wave.series(arb(u).union(arb(v)), 1)[0]
        past = [level for start, level in self.levels if start <= u - u.floor()] or [self.levels[-1][1]]
        levels = [past[-1]] + [level for start, level in self.levels if start + (u - start).ceil() < v]
        return arb(min(levels)).union(arb(max(levels)))

    def linear(self, p: dict[str, Any]) -> None:
        """M, b, their norms (that of M without its last column); rho and B for `series`, rho large but B < 2^48."""
        c1, c2 = 2 * p["beta1"] / p["J1"], 2 * p["beta2"] / p["J2"]
        q0 = p["q1"] / p["J1"] + p["q2"] / p["J2"]
        one = str(len(self.forces) - 1)
        A = {("z", "z_dot"): fmpq(1), ("z_dot", "z_dot"): -c1, ("z_dot", one): q0}
        b = {"z_dot": 1 / p["J1"] + 1 / p["J2"]}
        if c1 != c2:
            A |= {("z_dot", "x2_dot"): c2 - c1, ("x2_dot", "x2_dot"): -c2, ("x2_dot", one): -p["q2"] / p["J2"]}
            b["x2_dot"] = -1 / p["J2"]
        wheels = [(y, sign, p["kappa" + y[1]] / p["mu" + y[1]], 2 * p["zeta_support" + y[1]], 1 / p["mu" + y[1]])
                  for y, sign in (("y1", 1), ("y2", -1)) if p["kind"] == "full"]
        if wheels and wheels[0][2:4] == wheels[1][2:4]:
            wheels = [("y", 1, *wheels[0][2:4], wheels[0][4] + wheels[1][4])]
        for y, sign, k, c, inverse in wheels:  # z'' holds sign y'', and 2 β1/J1 sign y' from −2 β1/J1 x1'
            v = y + "_dot"
            A |= {(y, v): fmpq(1), (v, y): -k, (v, v): -c, ("z_dot", y): -sign * k, ("z_dot", v): sign * (c1 - c)}
            b |= {v: sign * inverse, "z_dot": b["z_dot"] + inverse}
        for name, value in b.items():  # the damping force 2 ζ z' of S
            A[name, "z_dot"] = A.get((name, "z_dot"), fmpq(0)) - 2 * p["zeta"] * value
        self.names = list(dict.fromkeys(name for name, _ in A))
        columns = [*self.names, *map(str, range(len(self.forces)))]
        self.M = arb_mat([[self.T * A.get((i, j), 0) for j in columns] for i in columns])
        self.b = arb_mat([[self.T * b.get(i, 0)] for i in columns])
        d, self.norm_b, constants = len(self.names), largest(self.b.entries()), largest(self.M.entries())
        self.norm = largest([sum((abs(self.M[i, j]) for j in range(d)), arb(0)) for i in range(d)])
        self.d, self.rho, self.B = d, fmpq(2), arb("inf")
        while not self.B < 2**48:
            require(self.rho > fmpq(1, 10**5), "model: motion too fast, work beyond this program's limit")
            self.rho *= fmpq(4, 5)
            rho = arb(self.rho)
            chi = largest([arb(x) for _, x in self.levels]) if self.levels else self.wave.bound(rho)
            source = constants + sum((force.bound(rho) for force in self.forces), self.norm_b * chi)
            self.B = (rho * (self.norm + self.norm_b * chi)).exp() * (1 + rho * source)

    def expand(self, u: fmpq, h: fmpq, sigma: int) -> tuple[list[arb_mat], arb_mat, arb, arb]:
        """Taylor series in t of the matrix U with w(u + t) = U(t) w(u), 0 <= t <= h, in contact state σ; and U(h).
        While the contact state is frozen, f(z) = z − σ in contact, 0 if σ = 0, and (1) is linear: with a_k, χ_j the
        coefficients of a and χ, (k + 1) U_(k+1) = M U_k + a_k e1 e_last^T − b Σ_j χ_j (row 0 of U_(k−j) − [k = j] σ
        e_last^T). Solutions are entire. By Gronwall |U| <= B on |t| <= rho, by Cauchy |U_k| <= B rho^−k. With q = h/rho
        all terms k >= K add up to at most B q^K/(1 − q), those of the derivative to (B/rho) Σ k q^(k−1), which is
        (B/rho) (K q^(K−1)/(1 − q) + q^K/(1 − q)²): the last two results."""
        d, N, count = self.d, self.M.nrows(), 2 + (ctx.prec + 48) // (int((self.rho / h).floor()).bit_length() - 1)
        forces, first = [f.series(arb(u), count) for f in self.forces], arb_mat([[1] + [0] * (N - 1)])
        chi = [self.stiffness_range(u + h / 2, u + h / 2)] if self.levels else self.wave.series(arb(u), count)
        U, rows = [arb_mat([[int(i == j) for j in range(N)] for i in range(N)])], []
        for k in range(count - 1):
            new = self.M * U[k]
            for j, force in enumerate(forces):
                new[1, d + j] += force[k]
            if sigma:
                rows.append(first * U[k] - arb_mat([[0] * (N - 1) + [0 if k else sigma]]))
                new -= self.b * sum((rows[k - j] * x for j, x in enumerate(chi[1 : k + 1], 1)), rows[k] * chi[0])
            U.append(new / (k + 1))
        q, K = arb(h) / self.rho, count
        tail, slope = self.B * q**K / (1 - q), self.B / self.rho * (K * q ** (K - 1) / (1 - q) + q**K / (1 - q) ** 2)
        rest = arb_mat([[ball(tail) if i < d else 0 for _ in range(N)] for i in range(N)])
        return U, reduce(lambda end, term: end * arb(h) + term, U[::-1]) + rest, tail, slope

class Tube:
    """The motions from the cube X = c + [−r, r]^d at u = phase, for 0 <= s <= 1.
    `G` = [[D, y], [0, 1]] encloses the motion y(s) from c itself and a matrix D(s) of slopes: the difference of any two
    motions from X is δ(s) = Δ δ(0) with a matrix Δ in D. For their forces differ by χ (f(z) − f(z*)) = κ (z − z*) with
    κ(s) between 0 and χ, so δ solves the linear equation δ' = (M − κ b e0^T) δ; nothing need be differentiable.
    All motions at s lie in the box G E, E = ([−r, r], ..., [−r, r], 1). For `segment_image` D has other columns."""
    def __init__(self, mesh: Mesh, G: arb_mat, E: arb_mat, phase: fmpq, k: int) -> None:
        self.mesh, self.G, self.E, self.phase, self.k, self.least = mesh, G, E, phase, k, arb(10) ** 9
        self.sigma = self.start = 0

    def contact(self) -> int:
        """The contact state, if it is the same for all motions."""
        z = (self.G * self.E)[0, 0]
        require(abs(z) < 1 or abs(z) > 1, f"contact state at section {self.k} not proved")
        return 0 if abs(z) < 1 else 1 if z > 1 else -1

    def period(self, windows: list[dict[str, Any]]) -> None:
        """March over a mesh period: frozen contact state outside the windows, in pieces that end at jumps of χ."""
        s, jumps = fmpq(0), sorted({v - v.floor() for v in (start - self.phase for start, _ in self.mesh.levels)})
        for window in [*windows, {"time": [fmpq(1), fmpq(0)], "flank": 0}]:
            a, b = window["time"][0] - window["time"][1], window["time"][0] + window["time"][1]
            require(s <= a and b <= 1, f"switches[{self.k}]: windows out of order or beyond [0, 1]")
            for end in [v for v in jumps if s < v < a] + [a]:
                pieces = int(((end - s) * 8 / self.mesh.rho).ceil())
                for i in range(pieces):
                    self.frozen(s + i * (end - s) / pieces, (end - s) / pieces)
                s = end
            if window["flank"]:
                self.window(a, b, window["flank"], window["into"] == "contact")
                s = b

    def frozen(self, s: fmpq, h: fmpq) -> None:
        """Prove that no motion leaves the contact state on [s, s + h]; lower `least`, the distance of |z| from 1.
        The distance is 1 − |z| if free, σz − 1 in contact, concave in z, of slope ±1. Between times t1, t2, z is within
        (t2 − t1)²/8 max |z''| of its chord, or, if z' has no zero, between its end values. So the distance is at least
        the lesser at t1, t2 less that; times are halved until this is positive, and near the end values or >= least."""
        N, sigma, box, T = self.mesh.M.nrows(), self.sigma, self.G * self.E, self.mesh.T
        U, end, tail, slope = self.mesh.series(s + self.phase, h, sigma)
        z, z_dot = (arb_mat([[u[i, j] for j in range(N)] for u in U]) for i in (0, 1))
        columns = [arb_poly(column) for column in (z * self.G).transpose().tolist()]
        velocity, size = arb_poly((z_dot * box * T).entries()), sum((abs(x) for x in box.entries()), arb(0))
        def distance(t: fmpq) -> arb:
            terms = (column(arb(t)) * e for column, e in zip(columns, self.E.entries(), strict=True))
            z = sum(terms, ball(tail * size))
            return (z * sigma - 1 if sigma else 1 - abs(z)).lower()
        stack, count = [(fmpq(0), distance(fmpq(0)), h, distance(h))], 0
        while stack:
            (t1, left, t2, right), count = stack.pop(), count + 1
            low = ends = left.min(right).lower()
            require(ends > 0, f"contact state not proved {float(s + t1):.6f} mesh periods after section {self.k}")
            span = arb(t1).union(arb(t2))
            if not abs(velocity(span) + ball(tail * size * T)) > 0:
                low = (ends - arb(t2 - t1) ** 2 / 8 * abs(velocity.derivative()(span) + ball(slope * size * T))).lower()
            if low > 0 and (low > ends * 0.9 or low >= self.least):
                self.least = min(self.least, low)
                continue
            require(count < 2000, f"contact state not proved after section {self.k}: z too close to ±1")
            middle, value = (t1 + t2) / 2, distance((t1 + t2) / 2)
            stack += [(t1, left, middle, value), (middle, value, t2, right)]
        self.G = end * self.G

    def window(self, a: fmpq, b: fmpq, flank: int, contact: bool) -> None:
        """Prove one switch of every motion in the time window [a, b], and enclose y and D at its end.
        If z' has one sign there, and z is on one side of the flank at a, on the other at b, each motion crosses the
        flank exactly once."""
        before, way = self.G * self.E, flank if contact else -flank
        require(self.sigma == (0 if contact else flank), f"switches[{self.k}]: not from the state before")
        require(0 < b - a <= self.mesh.rho / 8, f"switches[{self.k}]: window too wide or empty")
        after, change = self.unknown(a, b - a)
        speed = (before[1, 0] + change) * way
        require(speed > 0 and (before[0, 0] + change) * flank > -1, f"switches[{self.k}]: z' is not proved of one sign")
        self.G = after
        require((before[0, 0] - flank) * way < 0 and ((self.G * self.E)[0, 0] - flank) * way > 0,
                f"switches[{self.k}]: no crossing of the flank proved in a window")
        self.least, self.sigma = min(self.least, speed.lower()), flank if contact else 0

    def unknown(self, s: fmpq, h: fmpq) -> tuple[arb_mat, arb]:
        """G at s + h whatever the contact states on [s, s + h], and by how much states change there at most.
        A state or a column of slopes g solves g' = M g + a e1 − b θ(s), θ = χ f(g[0]) for states, κ g[0] for slopes.
        As this right side R has the Lipschitz constant L, by Gronwall g changes by at most h max |R(g(s))| e^(hL). With
        the flow V of θ = 0, g(s + h) = V g(s) − v(s + h), v' = M v + b θ, v(s) = 0. So |v| <= ω = h |b| |θ| e^(h |M|),
        and v(s + h) lies in h (M [−ω, ω] + b θ)."""
        mesh, d, u, t, slopes = self.mesh, self.mesh.d, s + self.phase, arb(h), self.G.ncols() - 1
        chi, during, M = mesh.stiffness_range(u, u + h), arb(u).union(arb(u + h)), arb_mat(mesh.M)
        for j, force in enumerate(mesh.forces):
            M[1, d + j] += force.series(during, 1)[0]
        def theta(j: int, z: arb) -> arb:
            return chi.union(arb(0)) * z if j < slopes else chi * ((z - 1).max(arb(0)) + (z + 1).min(arb(0)))
        G = arb_mat([[*row, *states] for row, states in zip(self.G.tolist(), (self.G * self.E).tolist(), strict=True)])
        R = M * G - mesh.b * arb_mat([[theta(j, z) for j, z in enumerate(G.tolist()[0])]])
        growth = t * (t * (mesh.norm + mesh.norm_b * chi.abs_upper())).exp()
        changes = [ball(largest(column) * growth) for column in R.transpose().tolist()]
        drift = arb(0).union(t) * mesh.T  # z' = T w[1]
        thetas = [theta(j, G[0, j] + drift * (G[1, j] + change)) for j, change in enumerate(changes[:-1])]
        omega = arb_mat([[ball(t * mesh.norm_b * abs(x) * (t * mesh.norm).exp()) * (i < d) for x in thetas]
                         for i in range(M.nrows())])
        return mesh.series(u, h, 0)[1] * self.G - (mesh.M * omega + mesh.b * arb_mat([thetas])) * t, changes[-1]

    def follow(self, s: fmpq, h: fmpq) -> None:
        """Move to s + h: in one contact state if all motions are in it, else by halves, or, where these say no more,
        whatever the states. y alone is followed through shorter steps. What is tried first rests on guesses."""
        self.mesh.steps += 1
        require(self.mesh.steps <= STEPS, f"sets: more than {STEPS} steps for one transition")
        states = self.G * self.E
        z, move = states[0, 0], states[1, 0] * self.mesh.T * h
        try:
            self.sigma, self.least, ahead = self.contact(), arb(0), (z + move).mid()
            require(ahead * self.sigma > 1 if self.sigma else abs(ahead) < 1, "a switch is likely")
            return self.frozen(s, h)
        except Refused:
            pass
        if h > LEAST_STEP and abs(move) + self.mesh.T**2 * h**2 > z.rad():
            self.follow(s, h / 2)
            return self.follow(s + h / 2, h / 2)
        after, _ = self.unknown(s, h)
        if self.G.ncols() > 1:
            alone = Tube(self.mesh, arb_mat([[row[-1]] for row in self.G.tolist()]), arb_mat([[1]]), self.phase, self.k)
            alone.follow(s, h)
            after = arb_mat([[*row[:-1], *y] for row, y in zip(after.tolist(), alone.G.tolist(), strict=True)])
        self.G = after

def cube(mesh: Mesh, centre: list[fmpq], r: arb, phase: fmpq, k: int) -> Tube:
    """The motions from a cube, at its section."""
    d, last = mesh.d, [*map(arb, centre), arb(1)]
    G = arb_mat([[*(arb(i == j) for j in range(d)), x] for i, x in enumerate(last)])
    tube = Tube(mesh, G, arb_mat([[ball(r)]] * d + [[1]]), phase, k)
    tube.sigma = tube.start = tube.contact()
    return tube

def existence(S: list[arb_mat], F: list[arb_mat], r: arb) -> arb:
    """The least of 1 − |K − C|/r over all coordinates, for Krawczyk's operator K of F(x)_k = P(x_k) − x_(k+1) = 0.
    P is the map over one mesh period. F(x) − F(x*) = Δ (x − x*) with Δ in the cyclic matrix of slopes, S_k on the
    diagonal, −1 right of it. Let g(x) = x − Y F(x) with any matrix Y. On X = C + [−r, r]^(nd) it has values in K = C −
    Y F(C) + (1 − Y Δ)(X − C). If |K − C| < r in all rows, g maps X into its interior, by Brouwer has a fixed point; and
    |1 − Y Δ| < 1 in the max norm, so that Y is regular (hence F = 0 at the fixed point), and two zeros x, x*, for which
    x − x* = (1 − Y Δ)(x − x*), coincide. Any Y serves, as 1 − Y Δ is enclosed; this nearly inverts the midpoint of Δ:
    Y_ik = (S_(i−1) ... S_i − 1)^−1 S_(i−1) ... S_(k+1), indices modulo n."""
    n, d, prec, worst = len(S), S[0].nrows(), ctx.prec, arb(0)
    one, R = arb_mat([[int(i == j) for j in range(d)] for i in range(d)]), arb_mat([[ball(r)]] * d)
    extra = sum(int(float(1 + sum(abs(x).upper() for x in s.entries()))).bit_length() for s in S)
    require(n * n * (prec + extra) < 4 * 10**11 and extra < 10**5, "existence: work beyond this program's limit")
    for i in range(n):
        with ctx.workprec(prec + 64 + 2 * extra):
            *products, cycle = accumulate((S[i - m].mid() for m in range(1, n + 1)), arb_mat.__mul__, initial=one)
            inverse = (cycle - one).inv()
            Y = [(inverse * product).mid() for product in products]  # for k = i − 1, i − 2, ..., i − n
        change = arb_mat(d, 1)
        for m in range(n):
            residual = Y[(m + 1) % n] - Y[m] * S[i - 1 - m] + (one if m == n - 1 else 0 * one)
            change += residual * R - Y[m] * F[i - 1 - m]
        worst = worst.max(largest(change.entries()))
    return (1 - worst / r).lower()

def stability(S: list[arb_mat], Q: list[fmpq_mat]) -> arb:
    """The least pivot of Q_k − S_k^T Q_(k+1) S_k, over the largest entry of both Q. If all are positive, these matrices
    are positive definite for all S_k in the enclosures, also for the derivatives of P (which exist as z' ≠ 0 at the
    switches), and so is Q_0 − M^T Q_0 M with the monodromy matrix M. So no multiplier λ has |λ| = 1 (Mv = λv would give
    0 = v*Qv − |λ|² v*Qv > 0); Q_0 is positive on the invariant subspace of |λ| < 1, where v*Qv = Σ_j (M^j v)*(Q −
    M*QM)(M^j v), likewise negative on that of |λ| > 1. Hence it has as many positive and negative eigenvalues as there
    are multipliers inside and outside (Ostrowski and Schneider)."""
    least, d = arb(10) ** 9, S[0].nrows()
    for k, s in enumerate(S):
        here, there = Q[k], Q[(k + 1) % len(Q)]
        H = (arb_mat(here) - s.transpose() * arb_mat(there) * s).tolist()
        for j in range(d):
            require(H[j][j] > 0, f"stability: Q_{k} − S^T Q_{(k + 1) % len(Q)} S not proved positive definite")
            least = min(least, (H[j][j] / max(abs(x) for x in here.entries() + there.entries())).lower())
            for i in range(j + 1, d):
                for m in range(j + 1, i + 1):
                    H[i][m] -= H[i][j] * H[m][j] / H[j][j]
    return least

def growth(transitions: list[list[int]], weights: list[Any]) -> Any:
    """The least (A v)_i / v_i for the matrix A of a graph and positive weights v: at most the spectral radius of A
    (Collatz and Wielandt)."""
    sums = [0 * v for v in weights]
    for first, second in transitions:
        sums[first] += weights[second]
    return min(total / v for total, v in zip(sums, weights, strict=True))

class Parallelogram(NamedTuple):
    """The states c + a p + b q, |a| <= 1, |b| <= 1."""
    centre: list[fmpq]
    unstable: list[fmpq]
    stable: list[fmpq]

    def at(self, a: fmpq, b: fmpq, centre: bool = True) -> list[fmpq]:
        return [c * centre + a * p + b * q for c, p, q in zip(*self, strict=True)]

    def back(self) -> fmpq_mat:
        """(a, b) from a p + b q."""
        return fmpq_mat([list(pair) for pair in zip(self.unstable, self.stable, strict=True)]).inv()

    def apart(self, other: "Parallelogram") -> bool:
        """Whether all corners of the other lie beyond one edge of this."""
        corners = [back * fmpq_mat([[x - c] for x, c in zip(other.at(a, b), self.centre, strict=True)])
                   for back in [self.back()] for a in (fmpq(-1), fmpq(1)) for b in (fmpq(-1), fmpq(1))]
        return any(all(sign * corner[i, 0] > 1 for corner in corners) for i in (0, 1) for sign in (1, -1))

def segment_image(mesh: Mesh, x: list[fmpq], h: list[fmpq], sizes: list[fmpq]) -> Tube:
    """The motions from the segment x + t h, |t| <= 1, from τ = 0 to T: a tube of the motion from x, the slopes from h,
    and those by the unknown amplitudes, which differ by up to `sizes` from the model's."""
    m, E = len(sizes), arb_mat([[ball(arb(1))], *([ball(arb(size))] for size in sizes), [1]])
    rows = [[arb(v), *[arb(0)] * m, arb(w)] for v, w in zip(h, x, strict=True)]
    tube = Tube(mesh, arb_mat(rows + [[arb(i == j) for j in range(-1, m + 1)] for i in range(m + 1)]), E, fmpq(0), 0)
    for s, end in pairwise(sorted({fmpq(0), fmpq(1), *(start - start.floor() for start, _ in mesh.levels)})):
        count = int(((end - s) * 8 / mesh.rho).ceil())
        for i in range(count):
            tube.follow(s + i * (end - s) / count, (end - s) / count)
    return tube

def covered(mesh: Mesh, N: Parallelogram, M: Parallelogram, sizes: list[fmpq]) -> int:
    """Prove that N covers M under the map P from τ = 0 to T; the number of pieces of the boundary of N.
    In the coordinates (a, b) of M, P maps one of the edges a = ±1 of N to a < −1 − slack, the other to a > 1 + slack,
    and N to where |b| < 1 − slack or |a| > 1 + slack. Then a chain of sets, each covering the next, is followed by a
    motion, a closed one by a periodic motion (Zgliczyński and Gidea 2004). For N the boundary is enough: P is
    continuous and one to one, and no part of the rest of the plane is bounded, so none is within the image of the
    boundary. Its pieces are halved until the condition holds for all states from each."""
    back, mesh.steps = arb_mat(M.back()), 0
    def image(x: list[fmpq], h: list[fmpq]) -> tuple[arb_mat, arb_mat]:
        """(a, b) of the motion from x, and of all motions from the segment."""
        tube = segment_image(mesh, x, h, sizes)
        C, G = arb_mat([[c] for c in M.centre]), back * arb_mat(tube.G.tolist()[:2])
        middle = arb_mat([[G[i, G.ncols() - 1]] for i in (0, 1)]) - back * C
        return middle, G * tube.E - back * C
    def inside(x: arb_mat, side: int) -> bool:
        a, b = x.entries()
        return bool(side * a > 1 + SLACK if side else abs(a) > 1 + SLACK or abs(b) < 1 - SLACK)
    zero, one, half, count = fmpq(0), fmpq(1), fmpq(1, 2), 0
    way = 1 if image(N.at(one, zero), [zero, zero])[0][0, 0] > 0 else -1
    stack = [piece for e in (-1, 1) for v in (-half, half)
             for piece in (((e * one, v, zero, half), e * way), ((v, e * one, half, zero), 0))]
    while stack:
        (a, b, da, db), side = stack.pop()
        middle, whole = image(N.at(a, b), N.at(da, db, centre=False))
        count += 1
        if not inside(whole, side):
            require(inside(middle, side) and count < 400, "sets: one does not cover that to which a transition leads")
            stack += [((a + e * da / 2, b + e * db / 2, da / 2, db / 2), side) for e in (-1, 1)]
    return count

def plain(x: fmpq) -> str:
    """A text that means exactly the number."""
    text = str(x) if x.q == 1 else repr(int(x.p) / int(x.q))
    return text.replace("e-0", "e-") if read(text, NUMBER, "number") == x else f"{x.p}/{x.q}"

def as_double(text: str) -> str:
    """A hexadecimal number as the shortest decimal one of which it is the nearest double, if it is one."""
    x = float.fromhex(text)
    return repr(x) if read(text, NUMBER, "number") == fmpq(*x.as_integer_ratio()) else f'"{text}"'

def plural(n: int, noun: str) -> str:
    return f"{n} {noun}{'' if n == 1 else 's'}"

def theorem(c: dict[str, Any]) -> str:
    """What a certificate that was read by its table claims."""
    return chaos_in_words(c) if "sets" in c else orbit_in_words(c)

def orbit_in_words(c: dict[str, Any]) -> str:
    n, inside, outside = c["period"], c["stability"]["inside"], c["stability"]["outside"]
    when, count = "k" if c["phase"] == 0 else f"(k + {plain(c['phase'])})", sum(map(len, c["switches"]))
    return " ".join((
        f"For the {kind_of(c['model'])} model with the parameters below, in the coordinates",
        f"{', '.join(c['coordinates'])}, there is exactly one orbit of period {plural(n, 'mesh period')} whose",
        f"states at tau = {when} T (k = 0 ... {n - 1}) lie" if n > 1 else f"state at tau = {when} T (k = 0) lies",
        f"within {plain(c['radius'])} of the point{'s' * (n > 1)} listed, in each coordinate.",
        *(["It repeats after no smaller number of mesh periods."] if n > 1 else []),
        f"Its teeth switch contact {plural(count, 'time')}, in the order and the time windows listed." if count
        else "Its teeth never switch contact.",
        f"Of its {inside + outside} multipliers {inside} lie{'s' * (inside == 1)} inside the unit circle and {outside} "
        "outside: it is unstable." if outside
        else f"All {inside} of its multipliers lie inside the unit circle: it is stable in these coordinates."))

def chaos_in_words(c: dict[str, Any]) -> str:
    length, words = shift(c["transitions"], len(c["sets"]))
    near = "".join(f", for every eps{j} within {plain(size)} of its value" for j, size in tolerances(c).items())
    return " ".join((
        f"Let P be the map of the states (z, z_dot) of the {kind_of(c['model'])} model with the parameters below",
        f"over one mesh period from tau = 0 on{near}.",
        f"Each of the {len(c['sets'])} parallelograms listed covers, with a slack of {plain(100 * SLACK)} %, those to",
        "which a transition leads from it. So every path along the transitions is followed by a motion, and every",
        "closed path by a periodic one. Parallelograms to which the same one leads are disjoint, so different paths",
        f"from the same one have different motions. The topological entropy of P is at least {plain(c['entropy'])}",
        f"(natural logarithm, a mesh period). There is a chaotic set, on which P^{length} is semiconjugate to the",
        f"shift on {words} symbols. It need not attract: such sets exist inside periodic windows too."))

def tolerances(c: dict[str, Any]) -> dict[int, fmpq]:
    """The unknown amplitudes of ε by harmonic."""
    out = {}
    for name, size in c["tolerances"].items():
        require(re.fullmatch("eps([1-9]|[1-5][0-9]|6[0-4])", name) is not None, "tolerances: not of eps1, ..., eps64")
        out[int(name[3:])] = read(size, NUMBER, f"tolerances.{name}")
        require(0 <= out[int(name[3:])] < 1, f"tolerances.{name}: must lie in [0, 1)")
    return dict(sorted(out.items()))

def shift(transitions: list[list[int]], count: int) -> tuple[int, int]:
    """The least length of which there are several closed paths from set 0, and their number."""
    require(count > 0 and all(len(pair) == 2 and min(pair) >= 0 and max(pair) < count for pair in transitions),
            "transitions: one does not join two sets")
    paths = [1] + [0] * (count - 1)
    for length in range(1, 200):
        after = [0] * count
        for first, second in transitions:
            after[second] += paths[first]
        paths = after
        if paths[0] > 1:
            return length, paths[0]
    raise Refused("transitions: no two closed paths of the same length up to 199 from set 0")

def prove_chaotic_set(c: dict[str, Any]) -> Result:
    unknown, sets = tolerances(c), [Parallelogram(**s) for s in c["sets"]]
    after: dict[int, list[int]] = {}
    mesh = Mesh(c["model"], [*unknown])
    require(c["coordinates"] == mesh.names == ["z", "z_dot"], "coordinates: must be z, z_dot, those of the model")
    require(all(len(x) == 2 for s in sets for x in s), "sets: not of two coordinates")
    require(all(s.unstable[0] * s.stable[1] != s.unstable[1] * s.stable[0] for s in sets), "sets: one has no area")
    require(len(c["transitions"]) <= 1000, "transitions: work beyond this program's limit")
    require(c["slack"] == SLACK, f"slack: must be {plain(SLACK)}")
    require(len(c["weights"]) == len(sets) and min(c["weights"]) > 0, "weights: not positive, or not one for each set")
    require(c["entropy"] > 0 and arb(growth(c["transitions"], c["weights"])).log() >= arb(c["entropy"]),
            "entropy: not positive, or more than the transitions and weights prove")
    for first, second in c["transitions"]:
        after.setdefault(first, []).append(second)
    require(all(len(following) <= BRANCHES for following in after.values()),
            f"transitions: more than {BRANCHES} lead from one set")
    for first, following in after.items():
        require(all(sets[i].apart(sets[j]) or sets[j].apart(sets[i]) for i, j in combinations(following, 2)),
                f"transitions: two sets to which set {first} leads are not apart")
    pieces = sum(covered(mesh, sets[i], sets[j], [*unknown.values()]) for i, j in c["transitions"])
    return Result(True, [f"covering relations: {len(c['transitions'])}, by {pieces} pieces of boundaries"], {})

def prove_orbit(c: dict[str, Any]) -> Result:
    n, mesh, phase, radius, points = c["period"], Mesh(c["model"]), c["phase"], c["radius"], c["points"]
    d, r, inside, Q, lists = mesh.d, arb(radius), c["stability"]["inside"], c["stability"]["Q"], c["switches"]
    require(c["coordinates"] == mesh.names, f"coordinates: those of this model are {', '.join(mesh.names)}")
    require(0 <= phase < 1 and radius > 0, "phase must lie in [0, 1), radius be greater than 0")
    require(n == len(points) > 0 and n == len(lists) == len(Q), "points, switches and Q: not one for each mesh period")
    require(all(len(x) == d for x in [*points, *Q, *(row for q in Q for row in q)]), f"points or Q: not of size {d}")
    require(all(len(w["time"]) == 2 and abs(w["flank"]) == 1 for x in lists for w in x),
            "switches: time must be two numbers, flank 1 or -1")
    steps, bits = n * (8 / mesh.rho + 3 * len(mesh.levels)) + 3 * sum(map(len, lists)), ctx.prec + 48
    require(steps * bits * (1 if mesh.levels else 1 + bits // 20) < 2 * 10**7, "work beyond this program's limit")
    Q = [fmpq_mat(q) for q in Q]
    require(all(q == q.transpose() for q in Q), "stability.Q: not symmetric")
    # All roots of the characteristic polynomial of Q_0 are real: Descartes' rule of signs counts the positive ones.
    positive = sum(a != b for a, b in pairwise(x > 0 for x in Q[0].charpoly().coeffs() if x != 0))
    require(Q[0].det() != 0 and positive == inside == d - c["stability"]["outside"], "stability: Q_0 has other inertia")
    gaps = [max(abs(points[0][i] - points[k][i]) for i in range(d)) / radius - 2 for k in range(1, n) if n % k == 0]
    require(all(gap > 0 for gap in gaps), "period: X_0 and X_k are not disjoint for a divisor k < n of n")  # x_0 ≠ x_k
    tubes = [cube(mesh, points[k], r, phase, k) for k in range(n)]
    for k, tube in enumerate(tubes):
        tube.period(lists[k])
        require(tube.sigma == tubes[(k + 1) % n].start, f"switches: end of mesh period {k} contradicts the next start")
    S = [arb_mat([[t.G[i, j] for j in range(d)] for i in range(d)]) for t in tubes]
    F = [arb_mat([[t.G[i, d] - points[(k + 1) % n][i]] for i in range(d)]) for k, t in enumerate(tubes)]
    own: dict[str, Any] = {"existence": existence(S, F, r), "separation": arb(min(gaps)).lower() if gaps else None}
    require(own["existence"] > 0, "existence: Krawczyk's operator does not map the cubes into themselves")
    own |= {"contact": min(t.least for t in tubes), "stability": stability(S, Q)}
    for name, value in own.items():
        claim = c["margins"][name]
        right = claim is None if value is None else claim is not None and claim > 0 and arb(claim) <= value
        require(right, f"margins.{name}: {claim} is claimed, {value} is proved")
    margins = {name: value if value is None else float(value) for name, value in own.items()}
    return Result(True, ["margins: " + ", ".join(f"{name} {v:.3g}" for name, v in margins.items() if v)], margins)

def table(certificate: Any) -> dict[str, Any]:
    """The table of the format of a certificate from JSON."""
    kind = read(certificate, dict, "certificate").get("format")
    require(type(kind) is str and kind not in NO_FORMS, f"format: {NO_FORMS.get(str(kind), 'not a string')}")
    require(kind in FORMS, f"format: must be one of {', '.join(FORMS)}")
    return FORMS[kind]

def canonical(certificate: dict[str, Any]) -> str:
    rest = {key: value for key, value in certificate.items() if key != "sha256"}
    return json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)

def checksum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()

def sealed(certificate: dict[str, Any]) -> dict[str, Any]:
    """With the theorem and the checksum made anew, for the program that writes it; nothing is proved."""
    out = certificate | {"theorem": "", "sha256": "0" * 64}
    out["theorem"] = theorem(read(out, table(out), "certificate"))
    return out | {"sha256": checksum(canonical(out))}

def verify(certificate: Any) -> Result:
    """Check a certificate that was read from JSON."""
    try:
        form, text = table(certificate), canonical(certificate)
        require(certificate.get("sha256") == checksum(text), "sha256: the file was altered")
        require(sum(abs(int(e)) for e in re.findall(r'[ep]([+-]?[0-9]{1,5})"', text)) <= EXPONENTS,
                f"certificate: the exponents of its numbers add up to more than {EXPONENTS}")
        c = read(certificate, form, "certificate")
        require(c["version"] == 1, "version: must be 1")
        require(32 <= c["bits"] <= 4096, "bits: must lie in [32, 4096]")
        require(c["theorem"] == theorem(c), "theorem: other words than those of the numbers in the file")
        with ctx.workprec(64 if "sets" in c else c["bits"] + 32):
            result = prove_chaotic_set(c) if "sets" in c else prove_orbit(c)
        model = re.sub(r'"(-?0x[^"]*)"', lambda m: as_double(m[1]), json.dumps(c["model"]))
        return Result(True, [f"proved: {theorem(c)}", *result.lines, f"model: {model}"], result.margins)
    except Refused as reason:
        return Result(False, [f"refused: {reason}"], {})
    except (ArithmeticError, LookupError, TypeError, ValueError, RecursionError, MemoryError) as error:
        return Result(False, [f"refused: cannot be evaluated ({type(error).__name__}: {error})"], {})

def verify_file(path: str | Path) -> Result:
    """Check a file."""
    try:
        require(Path(path).stat().st_size <= 2**28, "larger than 2^28 bytes")
        return verify(json.loads(Path(path).read_text(encoding="ascii"), object_pairs_hook=lambda pairs:
                                 dict(pairs) if len(dict(pairs)) == len(pairs) else None))  # None if a field is twice
    except (Refused, OSError, ValueError, RecursionError, MemoryError) as error:
        return Result(False, [f"refused: no readable JSON file ({error})"], {})

if __name__ == "__main__":
    sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    outcomes = []
    for path in sys.argv[1:]:
        outcomes.append(verify_file(path))
        print(path, *outcomes[-1].lines, sep="\n  ", flush=True)
    sys.exit(0 if outcomes and all(outcome.proved for outcome in outcomes) else 1)
