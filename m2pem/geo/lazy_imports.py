"""Libraries of geometry that take 0.3 s to load: each is imported when it is first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = ["rustworkx", "shapely"]

if TYPE_CHECKING:
    import rustworkx
    import shapely
else:

    class _Module:
        def __init__(self, name: str) -> None:
            self._name = name

        def __getattr__(self, attribute: str) -> Any:
            found = getattr(import_module(self._name), attribute)
            setattr(self, attribute, found)  # the next time it is found at once
            return found

    rustworkx, shapely = _Module("rustworkx"), _Module("shapely")
