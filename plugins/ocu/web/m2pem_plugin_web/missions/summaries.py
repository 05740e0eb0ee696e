"""What the list of missions says of each: its title, and whether it can run."""

from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.api import Draft, MissionControl, Severity
from m2pem.errors import MissionError
from m2pem_plugin_web.missions.folder import FolderError, MissionFolder, NoMissionError, Saved

_USES_OTHERS = (b"callActivity", b"import")
"""What a file has in it that may depend on others of the folder."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A mission of the folder. `runnable`: a check finds no errors."""

    saved: Saved
    title: str
    runnable: bool


class Summaries:
    """Remembers them as long as the files stay the same. Calls block: use threads."""

    def __init__(self, control: MissionControl, folder: MissionFolder) -> None:
        self._control = control
        self._folder = folder
        self._known: dict[tuple[str, str, tuple[str, ...]], tuple[str, bool]] = {}

    def all(self) -> Sequence[Summary]:
        """Those of the folder, in the order of the alphabet.

        Raises:
            FolderError: it cannot be read.
        """
        found = []
        for name in self._folder.names():
            try:
                found.append(self._folder.read(name))
            except (NoMissionError, FolderError):  # it went in the meantime, or is locked away
                continue
        together = tuple(f"{each.name} {each.version}" for each in found)
        known: dict[tuple[str, str, tuple[str, ...]], tuple[str, bool]] = {}
        summaries = []
        for saved in found:
            others = any(each in saved.source for each in _USES_OTHERS)
            key = (saved.name, saved.version, together if others else ())
            known[key] = self._known.get(key) or self._look(saved)
            summaries.append(Summary(saved, *known[key]))
        self._known = known
        return summaries

    def _look(self, saved: Saved) -> tuple[str, bool]:
        draft = Draft(saved.path, saved.source)
        try:
            processes = self._control.outline(draft).processes
        except MissionError:
            return "", False
        main = next((each for each in processes if each.starts), None)
        findings = self._control.check(draft)
        runnable = not any(each.severity is Severity.ERROR for each in findings)
        return (main.name or main.id) if main is not None else "", runnable
