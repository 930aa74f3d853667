"""JSON whose content is checked by a schema, since files of a store may be damaged or edited."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

_MAX_INT = 2**31 - 1
Whole = Annotated[int, Field(ge=0, le=2**63 - 1)]
Positive = Annotated[int, Field(ge=1, le=_MAX_INT)]
Seconds = Annotated[float, Field(ge=0, le=1e12)]


class StrictSchema(BaseModel):
    """A JSON object: unknown keys are refused, and types must match exactly."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


Schema = TypeVar("Schema")


def parse_as(schema: type[Schema], content: bytes) -> Schema:
    """The content of a file by its schema; raises ValueError that names the first wrong field and its fault."""
    try:
        return TypeAdapter(schema).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "it"
        raise ValueError(f"{where}: {first['msg']}") from None
