"""Study files in TOML, which describe a model and a study of it.

A file has ``[model]`` (with ``[model.error]`` and ``[model.stiffness]``), ``[gearpair]`` or ``[design]`` (with
``[operation]``), ``[initial]``, and ``[study]`` with ``[classification]``; every table is optional.
``StudyFile.model_json_schema()`` describes the layout.
"""

from gearchaos.studyfile.loading import LoadedStudy, load_design, load_study, open, parse_set, parse_value
from gearchaos.studyfile.tables import StudyFile

__all__ = ["LoadedStudy", "StudyFile", "load_design", "load_study", "open", "parse_set", "parse_value"]
