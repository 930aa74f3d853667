"""
How does chaos begin?
=====================

The damping falls from right to left. At each value the displacement is marked once per mesh period, after the motion
has settled: two points are a motion that repeats with every second tooth, four points one with every fourth. The period
doubles faster and faster, and at a damping of 0.09 it has doubled infinitely often: chaos.
"""

import json

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.6, q0=0.1, eps1=0.1, zeta=0.12)
diagram = gc.bifurcation(model, "zeta=0.06:0.14:500", mode="down")
ax = gc.plot.bifurcation(diagram)

# %%
# The values at which the period doubles, by continuation. The ratio of successive intervals approaches Feigenbaum's
# constant 4.669, as in every system that becomes chaotic in this way.

branches = gc.branch(model, "zeta=0.06:0.14", cascade=4)
print("doubled at", branches.event_value.values[branches.event_kind.values == "flip"].round(5).tolist())
print("ratios", [round(ratio, 2) for ratio in json.loads(branches.attrs["feigenbaum"])])
