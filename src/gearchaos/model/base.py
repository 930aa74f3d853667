"""What models of a gear pair and of a gear train answer alike."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from gearchaos.display import HasCard

SAMPLES = 64
"""Instants in a mesh cycle that show what happens in it."""


class GearModel(HasCard):
    """What studies take: by default one pair of gears, whose mesh needs no name."""

    is_operated: ClassVar[bool] = False  # whether it has a speed in rpm and a torque in N m

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """The names by which results are given for each mesh; none for a pair."""
        return ()

    @property
    def cycles(self) -> Mapping[str, int]:
        """Cycles in a period of each mesh that varies, by name, where these need not be 1."""
        return {}

    @property
    def most_cycles(self) -> int:
        """Those of the mesh that has the most; 1 where none varies."""
        return max(self.cycles.values(), default=1)

    @property
    def least_damping_in_words(self) -> str:
        """The least damping ratio, of a train with the mode that has it."""
        model: Any = self
        return f"a damping ratio of {model.zeta:.3g}"

    def resonates(self, speed: float) -> bool:
        """Whether an excitation may meet a natural frequency up to this speed of the first body, rpm."""
        return True

    def fastest_in_words(self, rate: float, omega: float) -> str:
        """What makes the fastest rate of the motion, at this frequency of the period, and what to do about it."""
        return (f"The fastest rate of the motion is {rate:.3g}, the mesh frequency omega {omega:.3g}: raise omega or "
                "J, or lower zeta, zeta_support or kappa/mu.")

    @property
    def in_words(self) -> str:
        """What it is computed as, if that is not as it was given."""
        return ""

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Of a train, what stands for what its parts leave open, in words; of a pair its design says it."""
        return ()

    @property
    @abstractmethod
    def known_names(self) -> tuple[str, ...]:
        """All names by which a value can be set; of the harmonics only the first of each family."""

    @abstractmethod
    def record(self) -> dict[str, Any]:
        """All its fields as numbers, texts, lists and tables, for files."""
