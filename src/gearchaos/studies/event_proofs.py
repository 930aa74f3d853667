"""Proofs of events: that a flip, fold, graze or Neimark-Sacker bifurcation lies where it was located."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.continuation.shooting import ACCEPTED, converge
from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import MeshModel
from gearchaos.studies.proofs import LEAST_BITS, MOST_BITS, check_installed
from gearchaos.validation import to_float

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.event import End, EventCertificate
