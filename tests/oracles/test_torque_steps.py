"""A run-up whose torque changes with each mesh period, beside DOP853 on the wheels in SI."""

import numpy as np

import gearchaos as gc
from gearchaos.studyfile import load_study
from tests import ONE_SPRING
from tests.oracles import scipy_oracle


def test_positions_and_velocities_of_the_wheels_stay_where_the_torque_steps():
    """c0, ω0 and ζ of this design depend on the torque. Teeth separate in some of the periods."""
    model = load_study(ONE_SPRING).model
    speeds, duration, rows = (7000.0, 7100.0), 0.019, [30.0, 270.0, 60.0, 210.0, 40.0]
    times = np.linspace(0, 0.02, len(rows))
    study = gc.RunUp(model, f"speed={speeds[0]}:{speeds[1]}", duration, torque={"time": times, "torque": rows},
                     signal=True)
    found = gc.physical(study.run())
    rate, periods = (speeds[1] - speeds[0]) / duration, found.sizes["instant"] // study.samples
    turns = np.arange(periods + 1) / 50  # of the wheel, 60 turns/min
    ends = 120 * turns / (speeds[0] + np.sqrt(speeds[0] ** 2 + 120 * rate * turns))
    torque = np.interp((ends[1:] + ends[:-1]) / 2, times, rows)
    torque = 30.0 + 0.06 * np.round((torque - 30.0) / 0.06)  # 4000 steps from 30 to 270 N m
    started = study._settled()[0]  # settled at the first speed and torque
    first = model.with_values({"speed": speeds[0], "torque": rows[0]})
    state = {"x1": started[0] + error(first, 0), "x1_dot": started[1] + error(first, 1), "x2": 0.0, "x2_dot": 0.0}
    scales, lost, off = first.gears.to_pair().scales, 0, []
    state = {name: value * (scales.velocity if "dot" in name else scales.length) for name, value in state.items()}
    for k in range(50):  # after 60 the motion, which depends on its beginning, is another one
        there = model.with_values({"speed": 60 / (50 * (ends[k + 1] - ends[k])), "torque": torque[k]})
        scales = there.gears.to_pair().scales
        begun = there.with_values({name: value / (scales.velocity if "dot" in name else scales.length)
                                   for name, value in state.items()})
        z, v = (begun.initial[f"x1{d}"] - begun.initial[f"x2{d}"] - error(there, n) for n, d in enumerate(("", "_dot")))
        chi, contact = float(begun.stiffness.at(0.0, begun.omega)), abs(z) > 1
        force = scales.force * contact * (2 * begun.zeta * v + chi * np.sign(z) * (abs(z) - 1))
        lost += not contact
        off.append(abs(found.signal_force[0, study.samples * k].item() - force))
        motion = scipy_oracle.trajectory(begun, [begun.period])
        state = {name: motion[name][-1] * (scales.velocity if "dot" in name else scales.length)
                 for name in ("x1", "x1_dot", "x2", "x2_dot")}
    assert 5 < lost < 45
    assert max(off) < 3e-7 * float(np.abs(found.signal_force).max())  # single precision


def error(model, derivative):
    """ε or ε' at phase 0."""
    a, p = (np.array(values) for values in (model.error.amplitudes, model.error.phases))
    order = np.arange(1, len(a) + 1)
    return float(np.sum(a * np.cos(p)) if derivative == 0 else np.sum(order * model.omega * a * np.sin(p)))
