"""heyoka's Taylor integrator with located events, scalar and in batches; one integrator serves every state.

Time is the mesh angle ωτ, so that a batch of different ω stops together. Contact switches and stiffness jumps are
terminal events whose callbacks change parameters and let the integration go on: no return to Python code in between
but the callback itself.
"""

from __future__ import annotations

import heyoka as hy
import numpy as np

from gearchaos.model.switched import SwitchedAffine

hy.set_logger_level_error()

_ON, _SIGMA, _CHI, _SCALE = range(4)


class Heyoka:
    """Trajectories one after another, or ``batch`` at a time; the contact ratio must be 1.5."""

    def __init__(self, system: SwitchedAffine, batch: int = 1) -> None:
        self.system, self.batch = system, batch
        d = system.dimension
        self.entries = [(i, j) for i in range(d) for j in range(d) if np.any(system.A[:, i, j] != 0)]
        self.integrator = self._integrator(d)
        self.numbers = self._numbers()

    def _integrator(self, d: int):
        w, par = hy.make_vars(*[f"w{i}" for i in range(d)]), hy.par
        position = {e: 4 + n for n, e in enumerate(self.entries)}
        at = 4 + len(self.entries)
        spring = par[_ON] * par[_CHI] * (w[0] - par[_SIGMA])
        rows = []
        for i in range(d):
            total = sum((par[position[i, j]] * w[j] for j in range(d) if (i, j) in position), start=hy.expression(0.0))
            if i > 0:
                total = total - par[at + i] * spring + par[at + d + i]
            if i == 1:
                total = total + par[at + 2 * d] * hy.cos(hy.time) + par[at + 2 * d + 1] * hy.sin(hy.time)
            rows.append((w[i], par[_SCALE] * total))
        events = [(w[0] - 1.0, _front), (w[0] + 1.0, _back), (hy.sin(hy.time), _jump)]
        if self.batch == 1:
            made = [hy.t_event(e, callback=_Scalar(c)) for e, c in events]
            return hy.taylor_adaptive(rows, np.zeros(d), t_events=made, pars=np.zeros(at + 2 * d + 2))
        made = [hy.t_event_batch(e, callback=_Batch(c)) for e, c in events]
        zeros = np.zeros((at + 2 * d + 2, self.batch))
        return hy.taylor_adaptive_batch(rows, np.zeros((d, self.batch)), t_events=made, pars=zeros)

    def _numbers(self) -> np.ndarray:
        s = self.system
        A = np.stack([s.A[:, i, j] for i, j in self.entries])
        head = np.stack([np.zeros(s.points), np.zeros(s.points), s.levels[:, 0], 1 / s.omega])
        return np.concatenate([head, A, s.b.T, s.f0.T, s.f_cos.T, s.f_sin.T])

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        out = np.empty_like(w)
        for first in range(0, w.shape[1], self.batch):
            lanes = slice(first, first + self.batch)
            self._start(w[:, lanes], self.numbers[:, lanes])
            end = 2 * np.pi * periods
            self.integrator.propagate_until(end if self.batch == 1 else [end] * self.batch)
            out[:, lanes] = self.integrator.state.reshape(w.shape[0], -1)
        return out

    def _start(self, w: np.ndarray, numbers: np.ndarray) -> None:
        ta, shape = self.integrator, self.integrator.state.shape
        ta.reset_cooldowns()
        if self.batch == 1:
            ta.time = 0.0
        else:
            ta.set_time(0.0)
        ta.state[:] = w.reshape(shape)
        ta.pars[:] = numbers.reshape(ta.pars.shape)
        z = w[0]
        ta.pars[_ON] = np.abs(z) > 1 if self.batch > 1 else float(abs(z[0]) > 1)
        ta.pars[_SIGMA] = np.sign(z) * (np.abs(z) > 1) if self.batch > 1 else float(np.sign(z[0]) * (abs(z[0]) > 1))


def _front(pars, lane, sign):
    pars[(_ON, *lane)], pars[(_SIGMA, *lane)] = (1.0, 1.0) if sign > 0 else (0.0, 0.0)


def _back(pars, lane, sign):
    pars[(_ON, *lane)], pars[(_SIGMA, *lane)] = (1.0, -1.0) if sign < 0 else (0.0, 0.0)


def _jump(pars, lane, sign):
    """sin t falls through zero in the middle of the period, where the stiffness drops, and rises at its end."""
    pars[(_CHI, *lane)] = _LEVELS[0] if sign > 0 else _LEVELS[1]


_LEVELS = (1.25, 0.75)


class _Scalar:
    def __init__(self, change):
        self.change = change

    def __call__(self, ta, sign):
        self.change(ta.pars, (), sign)
        return True


class _Batch:
    def __init__(self, change):
        self.change = change

    def __call__(self, ta, sign, lane):
        self.change(ta.pars, (lane,), sign)
        return True
