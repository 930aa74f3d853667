"""Attributes of variables and axes in files of version 0.1, which must stay: files of all versions are compared."""

from __future__ import annotations

import numpy as np
import pytest

from gearchaos.datasets import describe, variable
from gearchaos.gears.mesh.pair import Scales
from gearchaos.gears.operation.results import scaled
from gearchaos.model import MeshModel

# name | long_name | units | units for a pair, if there are others | long_name for a pair, if it is another
ATTRIBUTES = """
J | J | 1
attractor | attractor | 1
attractor_fraction | share of the starts | 1
attractor_fraction_hi | upper end of its 95 % interval | 1
attractor_fraction_lo | lower end of its 95 % interval | 1
attractor_kick | smallest change of the state that leaves the basin | 1
attractor_kick_change | kick_change | 1
attractor_kick_point | kick_point | 1
attractor_lyapunov_lo | lower end of its 99 % interval | omega0 | 1/s
attractor_section_z_dot | stroboscopic velocity of the dynamic transmission error | delta*omega0 | mm/s
attractor_up | attractor | 1
attractor_v_rms | rms of the velocity | delta*omega0 | mm/s
attractors | number of attractors found | 1
basin_entropy | basin entropy | nat
beta1 | beta1 | 1
boundary_basin_entropy | boundary basin entropy | nat
chi0 | chi0 | 1
chi1 | chi1 | 1
contact | contact state | 1
contact_fraction | share of the time in contact | 1
contact_ratio | contact_ratio | 1
contact_worst | worst contact state of the attractors | 1
dynamic_factor | dynamic factor | 1
eps1 | eps1 | 1 | µm
hysteresis | whether the sweeps end in different motions | 1
kappa | kappa | 1 | N/m
kappa1 | kappa1 | 1 | N/m
inferred | whether a cell was inferred, not computed | 1
label | kind of motion | 1
lyapunov | largest Lyapunov exponent | omega0 | 1/s
lyapunov_hi | upper end of its 99 % interval | omega0 | 1/s
lyapunov_lo | lower end of its 99 % interval | omega0 | 1/s
mesh_force | mesh force | c0*delta | N
mu1 | mu1 | 1
multiplier | largest modulus of the Floquet multipliers | 1
omega | mesh frequency | omega0 | Hz
period | period | T
periods_spent | transient and exponent run | T
q0 | q0 | 1 | N*m | driving torque
q1 | q1 | 1 | N*m | driving torque
q2 | q2 | 1 | N*m | resisting torque
reason | reason of the verdict | 1
residual | change of the polished orbit over one round | 1
rotation | rotation number, or a multiple of it | 1/T
section_x1 | stroboscopic x1 | delta | µm
start_z | dynamic transmission error | delta | µm
switches | contact switches per mesh period | 1/T
tau | time | 1/omega0 | ms
tau_section | time | 1/omega0 | ms
theta1 | theta1 | 1
trace_error | distance of the exponents' sum from the trace | omega0 | 1/s
transient_chaos | whether chaos came before the motion settled | 1
uncertainty_exponent | uncertainty exponent of the boundary | 1
v_rms | rms of the velocity | delta*omega0 | mm/s
v_rms_down | V_RMS after a sweep down | delta*omega0 | mm/s
v_rms_least | least V_RMS of the attractors | delta*omega0 | mm/s
v_rms_most | largest V_RMS of the attractors | delta*omega0 | mm/s
v_rms_up | V_RMS after a sweep up | delta*omega0 | mm/s
x1 | x1 | delta | µm
x1_dot | x1_dot | delta*omega0 | mm/s
x2 | x2 | delta | µm
x2_dot | x2_dot | delta*omega0 | mm/s
y1 | y1 | delta | µm
y1_dot | y1_dot | delta*omega0 | mm/s
y2 | y2 | delta | µm
y2_dot | y2_dot | delta*omega0 | mm/s
z | dynamic transmission error | delta | µm
z_dot | velocity of the dynamic transmission error | delta*omega0 | mm/s
z_dot_peak_to_peak | peak to peak of z' | delta*omega0 | mm/s
z_dot_rms | rms of z' | delta*omega0 | mm/s
z_peak_to_peak | peak to peak of z | delta | µm
z_rms | rms of z about its mean | delta | µm
zeta | zeta | 1
zeta_support | zeta_support | 1
"""


@pytest.mark.parametrize("row", ATTRIBUTES.strip().splitlines(), ids=lambda row: row.split(" | ")[0])
def test_attributes_are_those_of_version_0_1(row):
    name, long_name, units, *physical = row.split(" | ")
    assert describe(name) == {"long_name": long_name, "units": units}
    found = scaled({name: variable(name, (), np.array(1.0), coded=False)}, Scales(*[1.0] * 9)).get(name)
    attributes = {"units": physical[0], "long_name": physical[-1] if physical[1:] else long_name} if physical else None
    assert (found and found[2]) == attributes


def test_the_order_of_parameters_is_that_of_version_0_1():
    """Positional arguments of `MeshModel` and the order of `parameters` follow it."""
    assert " ".join(MeshModel().parameters()) == (
        "omega zeta J1 J2 q1 q2 beta1 beta2 mu1 mu2 kappa1 kappa2 zeta_support1 zeta_support2 eps1 theta1 chi1 chi2 "
        "contact_ratio")
