"""Packages whose names are imported when they are asked for, so that an import costs little.

Such a package imports its names for type checkers alone: `if TYPE_CHECKING: from a.b import C as
C`, which also says that it offers them. What is imported at run time is read there, so that no
second list can differ from it.
"""

import re
import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

_IMPORT = re.compile(r"^    from (\S+) import (?:\(\s+)?(\w+) as \2\b", re.MULTILINE)


def lazy_exports(package: str, file: str) -> tuple[Mapping[str, str], Callable[[str], Any]]:
    """Return the modules of a package's names, and the package's `__getattr__`.

    `file`: its `__file__`.
    """
    with open(file, encoding="utf-8") as source:  # noqa: PTH123  # pathlib loads slowly
        modules = {name: module for module, name in _IMPORT.findall(source.read())}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(modules[name])
        if not hasattr(module, name):  # a module in that package
            import_module(f"{modules[name]}.{name}")
        value = getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    return modules, load
