"""The pytest plugin that collects `NAME.test.yaml` beside `NAME.bpmn`.

There is a test for each scenario, and one for what they cover.

It is loaded in every run of pytest where m2pem is installed, so it imports the rest of m2pem only
when there is such a file.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from m2pem.coverage.mission_test import MissionTest, Outcome

SUFFIX = ".test.yaml"  # as in scenario_file, which is imported when there is such a file


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> "ScenariosOfMission | None":
    """Collect a file of scenarios. Other programs have files with this ending, too."""
    if not file_path.name.endswith(SUFFIX):
        return None
    if not file_path.with_name(file_path.name.removesuffix(SUFFIX) + ".bpmn").is_file():
        return None
    return ScenariosOfMission.from_parent(parent, path=file_path)


class ScenariosOfMission(pytest.File):
    """The scenarios of one mission."""

    def collect(self) -> Iterator[pytest.Item]:
        """Read mission and scenarios; what cannot be used is an error of the collection."""
        from m2pem.coverage.mission_test import MissionTest  # noqa: PLC0415  # see the module
        from m2pem.coverage.scenario_file import read_scenarios  # noqa: PLC0415
        from m2pem.coverage.suite import target_of  # noqa: PLC0415
        from m2pem.errors import FindingsError  # noqa: PLC0415
        from m2pem.plugins import PluginManager  # noqa: PLC0415

        try:
            file = read_scenarios(self.path)
            test = MissionTest(target_of(self.path).mission, file, PluginManager())
        except FindingsError as error:
            raise self.CollectError(str(error)) from error
        outcomes: dict[int, Outcome] = {}
        for number, scenario in enumerate(file.model.scenarios):
            yield ScenarioItem.from_parent(
                self, name=scenario.scenario, test=test, number=number, outcomes=outcomes
            )
        yield CoverageItem.from_parent(self, name="coverage", test=test, outcomes=outcomes)


class _FailedError(Exception):
    """What a test has found; shown without a traceback."""


class _Item(pytest.Item):
    def __init__(
        self, *, test: "MissionTest", outcomes: "dict[int, Outcome]", number: int = -1, **more: Any
    ) -> None:
        super().__init__(**more)
        self._test = test
        self._outcomes = outcomes
        self._number = number

    def outcome(self, number: int) -> "Outcome":
        """Return the outcome of a scenario, which is rehearsed once."""
        if number not in self._outcomes:
            self._outcomes[number] = self._test.play(number)
        return self._outcomes[number]

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """Show what was found."""
        if isinstance(excinfo.value, _FailedError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where it is: the line of the scenario."""
        line = self._test.file.line(self._number) - 1 if self._number >= 0 else None
        return self.path, line, f"{self.path.name}: {self.name}"


class ScenarioItem(_Item):
    """One scenario."""

    def runtest(self) -> None:
        """Rehearse it."""
        outcome = self.outcome(self._number)
        if outcome.differences:
            raise _FailedError("\n".join([f"{self.path}:{outcome.line}", *outcome.differences]))


class CoverageItem(_Item):
    """Whether the file says all that its scenarios do not see; a run with `-k` rehearses all."""

    def runtest(self) -> None:
        """Rehearse what was not, and search for runs to the rest."""
        from m2pem.coverage.report import coverage_problems  # noqa: PLC0415
        from m2pem.coverage.suite import LIMITS  # noqa: PLC0415

        count = len(self._test.file.model.scenarios)
        report = self._test.report([self.outcome(number) for number in range(count)], LIMITS)
        if problems := coverage_problems(report):
            raise _FailedError("\n".join(problems))
