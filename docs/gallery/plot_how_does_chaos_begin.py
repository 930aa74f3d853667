"""
How does chaos begin?
=====================

The transmission error grows from left to right. At each value the displacement is marked once per mesh period, after
the motion has settled: one point is a motion that repeats with every tooth, two points one that repeats with every
second tooth. The period doubles again and again within a short range, and then the points fill bands: chaos.
"""

import json

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.1)
diagram = gc.bifurcation(model, "eps1=0.17:0.24:500")
ax = gc.plot.bifurcation(diagram)

# %%
# The values at which the period doubles, from the branches of periodic orbits. The ratio of successive intervals
# approaches Feigenbaum's constant 4.669, as in every system that becomes chaotic in this way.

branches = gc.branch(model.with_values({"eps1": 0.206}), "eps1=0.1:0.24", cascade=3)
print("flips at", sorted(set(branches.event_value.values[branches.event_kind.values == "flip"].round(5).tolist())))
print("ratios", [round(ratio, 3) for ratio in json.loads(branches.attrs["feigenbaum"])])
