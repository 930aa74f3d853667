"""The tables of quantities, one row for each public name.

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4), 2008.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gearchaos.quantities.quantity import NOT_NEGATIVE, POSITIVE, Physical, Quantity, Range

_DAMPING = replace(NOT_NEGATIVE, advice="Damping takes energy out; use 0 for none.")

_LENGTH = Physical("length", 1e6, "µm")
_VELOCITY = Physical("velocity", 1e3, "mm/s")
_TIME = Physical("time", 1e3, "ms")
_FORCE = Physical("force", 1.0, "N")
_RATE = Physical("rate", 1.0, "1/s")
_STATE: dict[str, Any] = {"range": Range(-3.0, 3.0, -1000.0, 1000.0), "toml_table": "[initial]"}
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def _length(name: str, long_name: str = "", **fields: Any) -> Quantity:
    return Quantity(name, long_name=long_name, unit="delta", physical=_LENGTH, **fields)


def _velocity(name: str, long_name: str = "", **fields: Any) -> Quantity:
    return Quantity(name, long_name=long_name, unit="delta*omega0", physical=_VELOCITY, **fields)


def _rate(name: str, long_name: str = "", **fields: Any) -> Quantity:
    return Quantity(name, long_name=long_name, unit="omega0", physical=_RATE, **fields)


def _wheels(pair: Quantity, letter: str, tex: str, *own: Mapping[str, Any]) -> tuple[Quantity, ...]:
    """A parameter pair and its two members, one per wheel: fields of the pair, but their symbols and ``own`` fields."""
    return pair, *(
        replace(pair, name=name, symbol=_indexed(letter, n), tex=f"{tex}_{{{n}}}", axis_name="", members=(), **fields)
        for n, name, fields in zip((1, 2), pair.members, own or ({}, {}), strict=True))


def _indexed(letter: str, index: object) -> str:
    """A letter with a subscript, in Unicode."""
    return letter + str(index).translate(_SUBSCRIPTS)


def _torque(wheel: int, long_name: str) -> Physical:
    return Physical(f"torque{wheel}", 1.0, "N*m", long_name, _indexed("M", wheel), f"M_{{{wheel}}}")


def _support_stiffness(index: object) -> Physical:
    return Physical("stiffness", 1.0, "N/m", "", _indexed("c", index), f"c_{{{index}}}")


def of_order(family: Quantity, order: int) -> Quantity:
    """The quantity of the harmonic of order ``order`` of a family in `HARMONICS`."""
    symbol, tex = _indexed(family.symbol, order), f"{family.tex}_{{{order}}}"
    if physical := family.physical:
        physical = replace(physical, symbol=_indexed(physical.symbol, order), tex=f"{physical.tex}_{{{order}}}")
    return replace(family, name=f"{family.name}{order}", physical=physical, symbol=symbol, tex=tex)


PARAMETERS: tuple[Quantity, ...] = (
    Quantity("omega", "ω", r"\omega", long_name="mesh frequency", axis_name="frequency", title="mesh frequency",
             unit="omega0", physical=Physical("frequency", 1.0, "Hz", "mesh frequency", "f_z", "f_z"), divisor=True,
             rule=replace(POSITIVE, advice="It is the mesh frequency over sqrt(c0/m), (2.8)."),
             range=Range(0.2, 3.0, 0.05, 20.0)),
    Quantity("zeta", "ζ", r"\zeta", title="mesh damping", rule=_DAMPING, range=Range(0.0, 0.2, 0.0, 10.0)),
    *_wheels(
        Quantity("J", "J", "J", title="inertia", rule=POSITIVE, divisor=True, range=Range(0.5, 10.0, 0.05, 1000.0),
                 members=("J1", "J2")),
        "J", "J"),
    *_wheels(
        Quantity("q0", "q₀", "q_0", axis_name="static load", title="torque", physical=_torque(1, "driving torque"),
                 range=Range(0.0, 0.3, -100.0, 100.0), members=("q1", "q2")),
        "q", "q", {}, {"physical": _torque(2, "resisting torque")}),
    *_wheels(
        Quantity("beta", "β", r"\beta", title="bearing friction", rule=_DAMPING, divisor=True,
                 range=Range(0.0, 0.1, 0.0, 10.0), members=("beta1", "beta2")),
        "β", r"\beta"),
    *_wheels(
        Quantity("mu", "μ", r"\mu", title="wheel mass", rule=POSITIVE, divisor=True,
                 range=Range(0.5, 10.0, 0.05, 1000.0), members=("mu1", "mu2")),
        "μ", r"\mu"),
    *_wheels(
        Quantity("kappa", "κ", r"\kappa", axis_name="support stiffness", title="support stiffness", divisor=True,
                 rule=replace(POSITIVE, advice="For a rigid support use kind='torsional'."),
                 physical=_support_stiffness("1,2"), range=Range(0.1, 10.0, 0.005, 1000.0),
                 members=("kappa1", "kappa2")),
        "κ", r"\kappa", {"physical": _support_stiffness(1)}, {"physical": _support_stiffness(2)}),
    *_wheels(
        Quantity("zeta_support", "ζ₁,₂", r"\zeta_{1,2}", title="support damping", rule=_DAMPING,
                 range=Range(0.0, 0.1, 0.0, 10.0), members=("zeta_support1", "zeta_support2")),
        "ζ", r"\zeta"),
)
"""Scalar parameters of a model, (2.11), in the order of its fields. Parameters of the two wheels follow their pair, the
name that sets both."""

OPERATION: tuple[Quantity, ...] = (
    Quantity("speed", "n₁", "n_1", long_name="speed of wheel 1", axis_name="speed", title="speed", unit="rpm",
             rule=replace(POSITIVE, advice="It is the speed of wheel 1 in rpm."),
             range=Range(100.0, 6000.0, 1.0, 200_000.0), toml_table="[operation]"),
    Quantity("torque", "M₁", "M_1", long_name="torque at wheel 1", axis_name="torque", title="torque", unit="N*m",
             range=Range(0.0, 500.0, -1e6, 1e6), toml_table="[operation]"),
)
"""Parameters of an operating point, which a model of given gears also has."""

GEARS: tuple[Quantity, ...] = (
    Quantity("backlash", "j", "j", long_name="total backlash along the line of action",
             title="backlash, line of action", unit="µm", rule=POSITIVE, range=Range(10.0, 410.0, 0.1, 1e5)),
    Quantity("grade", "Q", "Q", long_name="accuracy grade", title="accuracy grade", range=Range(0.0, 12.0, 0.0, 12.0)),
)
"""Values of given gears that the explorer varies, beside those of `OPERATION`."""

PARTS: dict[str, Quantity] = {q.name: q for q in (
    Quantity("inertia", long_name="moment of inertia", axis_name="inertia", unit="kg*m^2", rule=POSITIVE),
    Quantity("torque", long_name="mean torque", axis_name="torque", unit="N*m"),
    Quantity("stiffness", long_name="mean stiffness", axis_name="stiffness", unit="N/m or N*m/rad", rule=POSITIVE),
    Quantity("damping", long_name="damping", axis_name="damping", unit="N*s/m or N*m*s/rad", rule=_DAMPING),
    Quantity("backlash", long_name="total backlash", axis_name="backlash", unit="m", rule=NOT_NEGATIVE),
    Quantity("stop", long_name="angle of the stops", axis_name="angle of the stops", unit="rad", rule=NOT_NEGATIVE),
    Quantity("stop_back", long_name="angle of the stops of the other side", axis_name="angle of the other stops",
             unit="rad", rule=NOT_NEGATIVE),
)}
"""Parameters of the parts of a gear train, in names such as ``loose.torque``: a part, a dot, and the parameter."""

HARMONICS: dict[str, Quantity] = {q.name: q for q in (
    Quantity("eps", "ε", r"\varepsilon", axis_name="error amplitude", title="error amplitude",
             physical=replace(_LENGTH, symbol="e", tex="e"), range=Range(0.0, 0.3, -10.0, 10.0),
             toml_table="[model.error], as amplitudes or phases"),
    Quantity("theta", "θ", r"\theta", title="error phase", range=Range(-3.2, 3.2, -100.0, 100.0),
             toml_table="[model.error], as amplitudes or phases"),
)}
"""Amplitudes and phases of the Fourier series of the transmission error, (2.15), and of the stiffness, (2.7), by
family. A name is a family and a harmonic order: ``eps3``. In names and titles of parameters "error" is the transmission
error."""

COORDINATES: tuple[Quantity, ...] = (
    _length("z", "dynamic transmission error", symbol="z", tex="z", axis_name="displacement", **_STATE),
    _velocity("z_dot", "velocity of the dynamic transmission error", symbol="z′", tex=r"\dot{z}", axis_name="velocity",
              **_STATE),
    _length("x1", symbol="x₁", tex="x_{1}", axis_name="displacement", **_STATE),
    _velocity("x1_dot", symbol="x₁′", tex=r"\dot{x}_{1}", axis_name="velocity", **_STATE),
    _length("x2", symbol="x₂", tex="x_{2}", axis_name="displacement", **_STATE),
    _velocity("x2_dot", symbol="x₂′", tex=r"\dot{x}_{2}", axis_name="velocity", **_STATE),
    _length("y1", symbol="y₁", tex="y_{1}", **_STATE),
    _velocity("y1_dot", symbol="y₁′", tex=r"\dot{y}_{1}", **_STATE),
    _length("y2", symbol="y₂", tex="y_{2}", **_STATE),
    _velocity("y2_dot", symbol="y₂′", tex=r"\dot{y}_{2}", **_STATE),
    _velocity("rotation_dot", "speed of turning as a whole", **_STATE),
)
"""Coordinates and velocities, (2.10) and (2.14), in units of half the backlash: the relative displacement z, the
rotations of the wheels as arc lengths x on the base circles, and the displacements y of their centres."""

RESPONSES: tuple[Quantity, ...] = (
    _velocity("v_rms", "rms of the velocity", symbol="V_RMS", tex=r"V_\mathrm{RMS}",
              title="V_RMS, rms of the velocity"),
    _length("z_rms", "rms of z about its mean", title="rms of z"),
    _length("z_peak_to_peak", "peak to peak of z", title="peak to peak of z"),
    _velocity("z_dot_rms", "rms of z'"),
    _velocity("z_dot_peak_to_peak", "peak to peak of z'"),
    Quantity("contact", long_name="contact state", title="contact"),
    Quantity("contact_fraction", long_name="share of the time in contact", title="share of the time in contact"),
    Quantity("mesh_force_peak", long_name="peak of the mesh force", title="peak mesh force", unit="c0*delta",
             physical=_FORCE),
    Quantity("dynamic_factor", long_name="dynamic factor", title="dynamic factor, peak over static force"),
    Quantity("mesh_contact", long_name="contact state of the mesh", title=""),
    Quantity("mesh_front_share", long_name="share of the time on the front flank"),
    Quantity("mesh_back_share", long_name="share of the time on the back flank"),
    Quantity("mesh_peak_force", long_name="peak of the force of the mesh", unit="c0*delta", physical=_FORCE),
    Quantity("mesh_rms_force", long_name="rms of the force of the mesh", unit="c0*delta", physical=_FORCE),
    _rate("mesh_impacts", "impacts of the mesh, closings of its contact"),
    Quantity("mesh_impulse", long_name="impulse of the contacts of the mesh per time", unit="c0*delta",
             physical=_FORCE),
    Quantity("mesh_dynamic_factor", long_name="dynamic factor of the mesh"),
    Quantity("mesh_force_deviation", long_name="standard deviation of the force of the mesh", unit="c0*delta",
             physical=_FORCE),
    Quantity("excitation_ratio", long_name="largest fall of the linear deflection over its mean"),
    Quantity("switches", long_name="contact switches per mesh period", unit="1/T"),
    Quantity("switches_per_period", long_name="contact switches per mesh period", unit="1/T"),
)
"""Response measures of a motion. The table that ``gearchaos regime`` prints has those with a title, in this order."""

VERDICTS: tuple[Quantity, ...] = (
    Quantity("label", long_name="kind of motion"),
    Quantity("period", long_name="period", unit="T"),
    Quantity("reason", long_name="reason of the verdict"),
    _rate("lyapunov", "largest Lyapunov exponent", symbol="λ₁", tex=r"\lambda_1", axis_name="largest exponent"),
    _rate("lyapunov_lo", "lower end of its 99 % interval"),
    _rate("lyapunov_hi", "upper end of its 99 % interval"),
    _rate("lyapunov_ci", "99 % intervals of the Lyapunov exponents"),
    _rate("lyapunov_spectrum", "Lyapunov exponents, largest first"),
    _rate("lyapunov_spectrum_lo", "lower ends of their intervals"),
    _rate("lyapunov_spectrum_hi", "upper ends of their intervals"),
    Quantity("residual", long_name="change of the polished orbit over one round", title="residual of the orbit"),
    _rate("trace_error", "distance of the exponents' sum from the trace", title="exponents' sum against the trace"),
    Quantity("multiplier", long_name="largest modulus of the Floquet multipliers"),
    Quantity("multipliers", long_name="Floquet multipliers"),
    Quantity("multipliers_real", long_name="real parts of the Floquet multipliers"),
    Quantity("multipliers_imag", long_name="imaginary parts of the Floquet multipliers"),
    Quantity("rotation", long_name="rotation number, or a multiple of it", unit="1/T"),
    Quantity("transient_chaos", long_name="whether chaos came before the motion settled"),
    Quantity("periods_spent", long_name="transient and exponent run", title="mesh periods computed", unit="T"),
    Quantity("spectral_label", long_name="kind of motion by the spectrum alone", title="kind by the spectrum alone"),
)
"""The kind of motion and its evidence. The table that ``gearchaos regime`` prints has the rows with a title, after the
response measures.

The ``residual`` is the largest change of a coordinate over one period of the orbit, at the point to which Newton's
method has converged ("polished" the orbit).
"""

RESULTS: tuple[Quantity, ...] = (
    Quantity("tau", "τ", r"\tau", long_name="time", unit="1/omega0", physical=_TIME),
    Quantity("tau_section", long_name="time", unit="1/omega0", physical=_TIME),
    Quantity("mesh_frequency", "f_z", "f_z", long_name="mesh frequency", unit="Hz"),
    Quantity("Kv_STANDARD", "K_v", "K_v", long_name="dynamic factor by a standard"),
    Quantity("quasi_static_ratio", long_name="peak of the mesh force over the static one at no speed"),
    Quantity("resonance_ratio", "N", "N", long_name="resonance ratio at the mean mesh stiffness of the design"),
    Quantity("resonance_ratio_ISO_B", "N", "N", long_name="resonance ratio by ISO 6336-1, method B"),
    _length("deflection", "deflection of the mesh, 0 where the front flanks touch", symbol="s", tex="s"),
    _velocity("deflection_rate", "rate of the deflection of the mesh", symbol="s′", tex=r"\dot{s}"),
    Quantity("mesh", long_name="mesh"),
    Quantity("history", long_name="how the motion was reached"),
    Quantity("onset_value", long_name="parameter at which contact begins to be lost"),
    Quantity("onset_linear", long_name="parameter at which the linear deflection begins to vanish"),
    Quantity("onset_mesh", long_name="mesh that loses contact"),
    Quantity("order_force", long_name="amplitude of the mesh force at an order", axis_name="mesh force",
             unit="c0*delta", physical=_FORCE),
    _length("order_deflection", "amplitude of the deflection of the mesh at an order", axis_name="deflection"),
    _length("order_transmission_error", "amplitude of the transmission error at an order",
            axis_name="transmission error"),
    Quantity("order_acceleration", long_name="amplitude of the acceleration of the transmission error at an order",
             axis_name="acceleration", unit="m/s^2"),
    Quantity("order_frequency", "f", "f", long_name="frequency of an order", unit="Hz"),
    Quantity("line", long_name="name of a strong line, by mesh and wheel"),
    Quantity("sideband_ratio", long_name="amplitude of a sideband over that of its mesh harmonic"),
    Quantity("modulation", long_name="amplitude of the envelope at an order over its mean"),
    Quantity("modulation_order", long_name="order of the envelope, per turn of the first wheel or body"),
    Quantity("cepstrum", long_name="real cepstrum of the lines"),
    Quantity("quefrency", long_name="quefrency, turns of the first wheel or body"),
    Quantity("speed_of_jump", long_name="speed of a jump", unit="rpm"),
    Quantity("direction_of_jump", long_name="direction of the run with the jump"),
    Quantity("factor_before_jump", long_name="dynamic factor before the jump"),
    Quantity("factor_after_jump", long_name="dynamic factor after the jump"),
    Quantity("clear_jump", long_name="whether the motion is steady before and after the jump"),
    Quantity("signal_time", "t", "t", long_name="time", unit="s"),
    Quantity("signal_force", long_name="mesh force", unit="c0*delta", physical=_FORCE),
    Quantity("signal_speed", long_name="speed of wheel 1", unit="rpm"),
    Quantity("varied", long_name="parameter that was varied"),
    Quantity("estimate", long_name="estimate of the parameter", unit="as estimate_unit says"),
    Quantity("estimate_lo", long_name="lower end of its 95 % interval", unit="as estimate_unit says"),
    Quantity("estimate_hi", long_name="upper end of its 95 % interval", unit="as estimate_unit says"),
    Quantity("bound_lo", long_name="lower bound of the parameter", unit="as estimate_unit says"),
    Quantity("bound_hi", long_name="upper bound of the parameter", unit="as estimate_unit says"),
    Quantity("estimate_unit", long_name="unit of the parameter"),
    Quantity("not_identified", long_name="why the parameter is not identified"),
    Quantity("measured_amplitude", long_name="measured amplitude", unit="that of the file"),
    Quantity("computed_amplitude", long_name="computed amplitude", unit="that of the file"),
    Quantity("search_rms", long_name="rms of the weighted residuals at the end of a search"),
    Quantity("outcome", long_name="what may happen"),
    Quantity("percentile", long_name="percentile", unit="%"),
    Quantity("output", long_name="result whose scatter is traced to inputs"),
    Quantity("aim", long_name="what is to become smaller"),
    Quantity("probability", long_name="probability of the outcome at a speed"),
    Quantity("probability_lo", long_name="lower end of its 95 % interval"),
    Quantity("probability_hi", long_name="upper end of its 95 % interval"),
    Quantity("anywhere", long_name="probability of the outcome at any of the speeds"),
    Quantity("anywhere_lo", long_name="lower end of its 95 % interval"),
    Quantity("anywhere_hi", long_name="upper end of its 95 % interval"),
    Quantity("probability_after_load_change", long_name="the same after a change of the load"),
    Quantity("probability_after_load_change_lo", long_name="lower end of its 95 % interval"),
    Quantity("probability_after_load_change_hi", long_name="upper end of its 95 % interval"),
    Quantity("anywhere_after_load_change", long_name="the same after a change of the load"),
    Quantity("anywhere_after_load_change_lo", long_name="lower end of its 95 % interval"),
    Quantity("anywhere_after_load_change_hi", long_name="upper end of its 95 % interval"),
    Quantity("lowest_speed_lost", long_name="lowest speed with contact loss", unit="rpm or omega0"),
    Quantity("highest_speed_lost", long_name="highest speed with contact loss", unit="rpm or omega0"),
    Quantity("share_lost", long_name="share of the speeds with contact loss"),
    Quantity("first_index", long_name="first-order index of Sobol"),
    Quantity("first_index_lo", long_name="lower end of its 95 % interval"),
    Quantity("first_index_hi", long_name="upper end of its 95 % interval"),
    Quantity("total_index", long_name="total index of Sobol"),
    Quantity("total_index_lo", long_name="lower end of its 95 % interval"),
    Quantity("total_index_hi", long_name="upper end of its 95 % interval"),
    Quantity("if_best", long_name="what is expected with the input held at its best value"),
    Quantity("if_best_lo", long_name="lower end of its 95 % interval"),
    Quantity("if_best_hi", long_name="upper end of its 95 % interval"),
    Quantity("best_from", long_name="lower end of the best part of the input", unit="as varied_unit says"),
    Quantity("best_to", long_name="upper end of the best part of the input", unit="as varied_unit says"),
    Quantity("if_halved", long_name="what is expected with half the spread of the input"),
    Quantity("if_halved_lo", long_name="lower end of its 95 % interval"),
    Quantity("if_halved_hi", long_name="upper end of its 95 % interval"),
    Quantity("distribution", long_name="distribution of the input"),
    Quantity("varied_unit", long_name="unit of the input"),
    Quantity("cut_share", long_name="share of the distribution beyond its limits"),
    Quantity("impossible", long_name="share of designs that are not possible"),
    Quantity("undecided_share", long_name="share of motions that are undecided"),
    Quantity("sample_value", long_name="value of the input, of a list the index", unit="as varied_unit says"),
    Quantity("sample_possible", long_name="whether the design is possible"),
    Quantity("sample_share_lost", long_name="share of the speeds with contact loss of a design"),
    Quantity("sample_contact", long_name="worst contact state of a design over the speeds"),
    Quantity("sample_factor", long_name="largest dynamic factor of a design over its quasi-static ratio"),
    Quantity("mode", long_name="natural mode"),
    Quantity("natural_frequency", "f", "f", long_name="natural frequency", unit="Hz"),
    Quantity("damping_ratio", "ζ", r"\zeta", long_name="damping ratio of the mode"),
    Quantity("rigid", long_name="whether the mode deflects nothing"),
    Quantity("body", long_name="body of the train"),
    Quantity("mode_angle", long_name="angle of a body in its own sense of rotation, of unit modal mass", unit="rad"),
    Quantity("mode_x", long_name="displacement of a centre along x, of unit modal mass", unit="m"),
    Quantity("mode_y", long_name="displacement of a centre along y, of unit modal mass", unit="m"),
    Quantity("kinetic_energy", long_name="share of a body in the kinetic energy of the mode"),
    Quantity("element", long_name="mesh, shaft or support"),
    Quantity("mode_deflection", long_name="deflection, of a shaft its twist, of unit modal mass", unit="m or rad"),
    Quantity("strain_energy", long_name="share of a mesh, shaft or support in the strain energy of the mode"),
    Quantity("excitation", long_name="excitation"),
    Quantity("order", long_name="order, per turn of the first wheel or body"),
    Quantity("mesh_force", "S", "S", long_name="mesh force", unit="c0*delta", physical=_FORCE),
    Quantity("inferred", long_name="whether a cell was inferred, not computed"),
    Quantity("proved", long_name="whether the periodic motion is proved"),
    Quantity("proof_reason", long_name="reason why the periodic motion is not proved"),
    Quantity("attractor"),
    Quantity("up", long_name="attractor"),
    Quantity("down", long_name="attractor"),
    Quantity("attractors", long_name="number of attractors found"),
    _velocity("v_rms_least", "least V_RMS of the attractors"),
    _velocity("v_rms_most", "largest V_RMS of the attractors"),
    _velocity("v_rms_up", "V_RMS after a sweep up"),
    _velocity("v_rms_down", "V_RMS after a sweep down"),
    Quantity("hysteresis", long_name="whether the sweeps end in different motions"),
    Quantity("contact_worst", long_name="worst contact state of the attractors"),
    Quantity("to_avoid", long_name="what is to be avoided"),
    Quantity("share_of_load_changes", long_name="share of load changes after which the teeth separate"),
    Quantity("share_of_load_changes_lo", long_name="lower end of its 95 % interval"),
    Quantity("share_of_load_changes_hi", long_name="upper end of its 95 % interval"),
    Quantity("fraction", long_name="share of the starts"),
    Quantity("fraction_lo", long_name="lower end of its 95 % interval"),
    Quantity("fraction_hi", long_name="upper end of its 95 % interval"),
    Quantity("random_states", long_name="number of random initial states"),
    Quantity("beyond_the_teeth", long_name="whether teeth cannot bear the motion"),
    Quantity("avoided_states", long_name="number of random initial states that lead to the motion to avoid"),
    Quantity("kick", long_name="smallest change of the state that leaves the basin"),
    Quantity("coordinate"),
    Quantity("kick_change"),
    Quantity("kick_point"),
    Quantity("basin_entropy", long_name="basin entropy", unit="nat"),
    Quantity("boundary_basin_entropy", long_name="boundary basin entropy", unit="nat"),
    Quantity("uncertainty_exponent", long_name="uncertainty exponent of the boundary"),
    _length("z_max", "largest z"),
    _length("z_min", "smallest z"),
    Quantity("branch", long_name="number of the branch"),
    Quantity("unstable", long_name="number of multipliers outside the unit circle"),
    Quantity("contact_sequence", long_name="contact states in order of time"),
    Quantity("step", long_name="distance along the branch from the point before"),
    Quantity("kind", long_name="kind of event"),
    Quantity("value", long_name="parameter at the event"),
    Quantity("boundary", long_name="boundary of contact that is touched, 1 or -1; 0 for none"),
    Quantity("point", long_name="index of the point before the event"),
    Quantity("position", long_name="index of the point among all points of the branches"),
    Quantity("direction", long_name="1 or up if the parameter rises, -1 or down if it falls"),
    Quantity("event", long_name="index of the event"),
    Quantity("curve", long_name="number of the curve; -1 for none"),
    Quantity("angle", long_name="argument of the critical multiplier", unit="rad"),
    Quantity("closed", long_name="whether the curve is closed"),
    Quantity("manifold", long_name="number of the branch of a manifold"),
    Quantity("saddle", long_name="number of the saddle"),
    Quantity("stable", long_name="whether the manifold is the stable one"),
    Quantity("complete", long_name="whether the branch was followed to the length asked for, or to its end"),
    Quantity("cause", long_name="why the motion ends at the side of a cell"),
    Quantity("seen", long_name="whether the curve passes a side at which it can end the motion"),
    Quantity("cells", long_name="number of cells with an orbit of the period"),
    Quantity("explained", long_name="share of these cells without unexplained side"),
    Quantity("sides", long_name="number of sides by cause"),
)
"""Other variables of results: time, mesh force, and variables of attractors, basins and maps.

The starts are the initial states of a study. ``up`` and ``down`` are the attractors reached by slow sweeps of a
parameter. ``contact_worst`` is the contact state with the most contact loss: two-sided before one-sided before
permanent. A kick is the smallest perturbation found after which a motion leaves its attractor: ``kick`` is its norm,
``kick_change`` the change of each ``coordinate`` of the state, and ``kick_point`` the state to which it is added. The
rows from ``branch`` on belong to branches of periodic orbits and, with the prefix ``event_`` or ``jump_``, to their
events and jumps; those from ``curve`` on to curves of events in two parameters, manifolds, and the agreement of curves
with a map.
"""
