"""The files that come with m2pem: missions, fleets, examples, and what a new folder begins with.

They are inside of an installed package, and in the root of a clone of the repository.
"""

import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

from m2pem.errors import OperatorError
from m2pem.suggestions import suggest

INDEX = re.compile(r"^\| \[(?P<short>\w+)\]\((?P<name>\w+)/README\.md\) \| (?P<shows>.+) \|$", re.M)
"""A line of the table in the README of the examples."""

LINK_OUTWARDS = re.compile(r"\[([^\]]+)\]\(\.\./[^)]+\)")
"""A link that leads out of the folder of an example."""


class CopyError(OperatorError):
    """There is no such example, or the new folder is not empty or cannot be made."""

    exit_status = 2


@dataclass(frozen=True, slots=True)
class Example:
    """An example. `short`: its number (`t01`); `name`: its folder; `shows`: what, in one line."""

    short: str
    name: str
    shows: str


def examples() -> Path:
    """Return the folder that holds `missions`, `fleet_configs` and `examples`.

    Raises:
        OperatorError: there is none.
    """
    package = Path(__file__).parents[1]
    for folder in (package / "examples", package.parent):
        if (folder / "missions").is_dir() and (folder / "fleet_configs").is_dir():
            return folder
    raise OperatorError(
        f"the missions of the demonstrations are not in {package / 'examples'}: install m2pem again"
    )


def list_examples() -> list[Example]:
    """The examples, in the order of their README."""
    text = (examples() / "examples" / "README.md").read_text(encoding="utf-8")
    return [
        Example(found["short"], found["name"], found["shows"]) for found in INDEX.finditer(text)
    ]


def copy_example(name: str, folder: Path | None = None) -> Path:
    """Copy an example, named by its number or its folder; returns the new folder.

    `folder` None: `examples/NAME`, from which the commands of its README work as they are. In
    another folder they are changed to work from here.

    Raises:
        CopyError: there is no such example, or the folder is not empty or cannot be made.
    """
    known = list_examples()
    found = next((each for each in known if name in (each.short, each.name)), None)
    if found is None:
        names = [each.short for each in known] + [each.name for each in known]
        hint = suggest(name, names, "examples")
        raise CopyError(f"there is no example {name!r}; {hint}")
    usual = Path("examples") / found.name
    target = usual if folder is None else folder
    _copy(examples() / "examples" / found.name, _empty(target))
    readme = target / "README.md"
    text = LINK_OUTWARDS.sub(r"\1", readme.read_text(encoding="utf-8"))
    readme.write_text(text.replace(str(usual), shlex.quote(str(target))), encoding="utf-8")
    return target


PLACES = ("road.geojson", "field.geojson", "base.geojson")
SHARED = {
    "sim": ("mission.bpmn", "fleet.yaml", "answers.yaml", *PLACES),
    "mavlink": ("mission.bpmn", "answers.yaml", *PLACES),
    "ros": ("answers.yaml", "road.geojson", "base.geojson"),
}
"""By kind of vehicles: the files of the example `notebook` that a new folder begins with."""

PLUGINS = {"mavlink": "m2pem_plugin_mavlink", "ros": "m2pem_plugin_ros"}
"""By kind of vehicles: the module of the plugin that they need."""


def make_folder(folder: Path, kind: str) -> list[str]:
    """Make a folder with a mission, a fleet, answers and a README; returns the names of its files.

    `kind` of vehicles: one of `SHARED`.

    Raises:
        CopyError: the folder is not empty, or cannot be made.
    """
    _copy(_templates() / "folder" / kind, _empty(folder))
    for name in SHARED[kind]:
        shutil.copyfile(examples() / "examples" / "notebook" / name, folder / name)
    return sorted(each.name for each in folder.iterdir())


def _templates() -> Path:
    package = Path(__file__).parents[1]
    inside = package / "templates"
    return inside if inside.is_dir() else package.parent / "templates"


def _empty(folder: Path) -> Path:
    """The folder, made if it was missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise CopyError(f"{folder} is not empty: name a new folder, or an empty one")
    except OSError as error:
        raise CopyError(f"{folder} cannot be made: {error.strerror}") from error
    return folder


def _copy(source: Path, folder: Path) -> None:
    shutil.copytree(
        source, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
    )
