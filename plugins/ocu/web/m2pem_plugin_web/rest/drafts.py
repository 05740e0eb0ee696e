"""The mission of a request: its own XML, or a mission of the folder."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ParamSpec, TypeVar

from fastapi import Path as InPath
from pydantic import Field, model_validator

from m2pem.api import Draft
from m2pem_plugin_web.missions.folder import (
    BadNameError,
    ChangedError,
    FolderError,
    MissionFolder,
    NoMissionError,
)
from m2pem_plugin_web.missions.names import LONGEST, PATTERN, SUFFIX
from m2pem_plugin_web.problems import ProblemError
from m2pem_plugin_web.rest.models import Body, Data, Name

P = ParamSpec("P")
T = TypeVar("T")

UNNAMED = "draft"
"""The name of a mission that has none yet."""

MissionName = Annotated[str, InPath(min_length=1, max_length=LONGEST, pattern=PATTERN)]
"""A name in an address."""

WrittenName = Annotated[str, Field(min_length=1, max_length=LONGEST, pattern=PATTERN)]
"""A name in a body."""


class DraftModel(Body):
    """A mission: as `xml`, or the `mission` of that name in the folder; not both.

    With both, `mission` is what the `xml` is called. `process`: None for its main one.
    """

    xml: str | None = None
    mission: WrittenName | None = None
    process: Name | None = None
    data: Data | None = None

    @model_validator(mode="after")
    def _there_is_one(self) -> "DraftModel":
        if self.xml is None and self.mission is None:
            raise ValueError("send xml, or the name of a mission")
        return self


async def draft_of(wanted: DraftModel, folder: MissionFolder) -> Draft:
    """Return the draft of a request.

    Raises:
        ProblemError: there is no such mission.
    """
    if wanted.xml is not None:
        name = f"{wanted.mission or UNNAMED}{SUFFIX}"
        return Draft(Path(folder.path, name), source_of(wanted.xml))
    saved = await of_folder(folder.read, wanted.mission or "")
    return Draft(saved.path, saved.source)


def source_of(xml: str) -> bytes:
    """Return a text as the bytes of a file.

    Raises:
        ProblemError: it has what no XML can have.
    """
    try:
        source = xml.encode()
    except UnicodeEncodeError:
        raise ProblemError(422, "xml: half a character, which no file can have") from None
    return source


async def of_folder(call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Call the folder in a thread.

    Raises:
        ProblemError: it refused.
    """
    try:
        return await asyncio.to_thread(call, *args, **kwargs)
    except NoMissionError as error:
        raise ProblemError(404, str(error)) from error
    except BadNameError as error:
        raise ProblemError(422, str(error)) from error
    except ChangedError as error:
        raise ProblemError(409, str(error), current=_line(error)) from error
    except FolderError as error:
        raise ProblemError(503, str(error)) from error


def _line(error: ChangedError) -> dict[str, Any] | None:
    current = error.current
    if current is None:
        return None
    return {
        "version": current.version,
        "by": current.by,
        "saved_at_us": current.saved_at_us,
    }
