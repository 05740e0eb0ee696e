"""Rehearses a mission many times: what `m2pem campaign` does, with the result as an object."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem.api.authoring import MissionSource
from m2pem.campaign.campaign import CampaignResult, run_campaign
from m2pem.campaign.html import html_page
from m2pem.campaign.report import report_of
from m2pem.campaign.report_files import markdown_lines, write_report
from m2pem.campaign.runs import Row, order_of, read_text
from m2pem.campaign.statistics import Effect, Estimate, effects, ends, failure, rehearsed
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.scripting.sources import FleetSource, fleet_of, load_mission


@dataclass(frozen=True, slots=True)
class Campaign:
    """The runs of a campaign, and what they say. `rows`: a dict for each run, with the columns of
    docs/campaigns.md, such as `took_s`; a run that could not be rehearsed has an `error`."""

    result: CampaignResult

    @property
    def rows(self) -> list[Row]:
        """One for each run, in the order of their numbers."""
        return list(self.result.rows)

    @property
    def failure(self) -> Estimate:
        """The probability of failure, with its interval."""
        return failure(rehearsed(self.result.rows))

    @property
    def ends(self) -> Mapping[tuple[str, str], Estimate]:
        """The probability of each outcome and end, the most likely first."""
        return ends(rehearsed(self.result.rows))

    @property
    def effects(self) -> list[Effect]:
        """What failures depend on, most of all first."""
        return effects(rehearsed(self.result.rows))

    @property
    def report(self) -> str:
        """The report, in Markdown."""
        return "\n".join(markdown_lines(report_of(self.result))) + "\n"

    def to_html(self) -> str:
        """Return the report as a page that needs no other file."""
        return html_page(report_of(self.result))

    def write(self, folder: str | Path) -> None:
        """Write the report with its charts, the rows as Parquet, and the worst runs as answers
        files."""
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        write_report(path, self.result)


def campaign(
    mission: MissionSource | Mission,
    fleet: FleetSource,
    *,
    runs: int = 1000,
    variations: Mapping[str, Any] | str | Path | None = None,
    seed: int = 0,
    required: Iterable[str] = (),
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    workers: int = 1,
    cluster: str = "",
    search_path: Iterable[str | Path] = (),
) -> Campaign:
    """Rehearse a mission so many times, with faults, times and conditions that are drawn.

    The same seed gives the same rows. `variations`: a variations file, or its content as a dict;
    None: nothing is drawn. `required`: ids of requirements in the mission's file; a run that
    violates one counts as a failure. `workers`: processes; 1 is this one. With more, a script needs
    `if __name__ == "__main__":`. `cluster`: the URL of a Dask scheduler, in place of them. An
    interrupt ends it, with the runs that are done.

    Raises:
        MissionError: the mission cannot be loaded, or does not fit the fleet.
        AnswersError: the variations cannot be used, or do not fit mission and fleet.
        FleetError: the fleet cannot be used.
        OperatorError: the cluster, or a requirement, is not there.
    """
    loaded = load_mission(mission, search_path)
    if variations is None:
        text = b""
    elif isinstance(variations, Mapping):
        text = json.dumps(variations).encode()
    else:
        text = read_text(Path(variations))
    order = order_of(
        loaded,
        fleet_of(fleet, loaded),
        text,
        seed,
        process=process,
        data=data,
        required=tuple(required),
    )
    return Campaign(run_campaign(order, runs, workers=workers, cluster=cluster))
