"""The order of the gallery: questions about gears first, then about maps, then about single motions."""

from __future__ import annotations

QUESTIONS = [
    "which_speeds_to_avoid", "when_do_the_teeth_hit_both_flanks", "what_does_a_coarser_accuracy_grade_cost",
    "does_the_direction_of_a_run_up_matter", "how_loud_does_the_mesh_get_as_torque_falls", "how_do_the_teeth_meet",
    "how_stiff_is_the_mesh", "what_excites_the_mesh", "which_motion_is_where", "how_much_damping_is_enough",
    "what_bounds_the_zone_of_doubled_periods", "where_is_more_than_one_motion_possible",
    "how_does_it_look_in_print_without_colour", "how_does_chaos_begin", "is_it_really_chaos",
    "which_motion_does_no_sweep_reach", "where_does_the_resonance_jump", "which_motions_coexist",
    "what_divides_these_basins", "how_hard_a_knock_changes_the_motion", "what_does_a_chaotic_motion_look_like",
    "what_shape_has_chaos", "what_is_a_quasi_periodic_motion", "what_would_a_microphone_hear", "what_is_in_the_model",
]


class GalleryOrder:
    """Key by which Sphinx-Gallery sorts the scripts of a folder; those that `QUESTIONS` lacks are last."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __repr__(self) -> str:
        return type(self).__name__

    def __call__(self, file: str) -> tuple[int, str]:
        """The place of a script, ``plot_<question>.py``."""
        question = file.removeprefix("plot_").removesuffix(".py")
        return QUESTIONS.index(question) if question in QUESTIONS else len(QUESTIONS), question
