"""The editor rehearses with answers files, as the worst runs of a campaign, and has the verdicts on
the requirements of the mission."""

import asyncio
import os
import re
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from playwright.async_api import Locator, Page, expect
from web_axe import Accessibility
from web_desk import FLEET, IN_ONE_LOOP, OVER, Desk
from web_pictures import picture
from web_served import REPOSITORY

pytestmark = IN_ONE_LOOP

REQUIREMENTS = b"""<bpmn:extensionElements>
  <m2pem:requirement id="soon" ltl="&lt;&gt;[0 s, 12.5 s] completed(UserSendRoute)"/>
  <m2pem:requirement id="asked" ltl="&lt;&gt; completed(UserSendRoute)"/>
  <m2pem:requirement id="untroubled" ltl="[] !active(Reverse)"/>
  <m2pem:requirement id="ends" ltl="&lt;&gt; ended(terminated)"/>
  <m2pem:requirement id="unmonitored" monitor="false" ltl="[] !active(DriveRoute)"/>
</bpmn:extensionElements>"""
BEGIN = b'<bpmn:process id="VIGNETTE1" name="VIGNETTE1" isExecutable="true">'
VARIED = """\
answers: {UserSendRoute: {continue: 9, abort: 1}}
answer_times: {UserSendRoute: 0..30 s}
behaviors:
  DriveRoute: {fails: {probability: 0.3, after: 5..60 s, error: ROUTE_BLOCKED}}
services:
  Detector: {after: {exponential: 40 s}, write: [{data: {detection.type: camera}}]}
links: [{vehicle: evsg1, at: 0..100 s, for: {exponential: 5 s}, probability: 0.5}]
vehicles: {evsg1: {battery: 30 %..100 %}}
wind: {speed: 0..8 m/s}
"""
VERDICTS = ("soon", "asked", "untroubled", "ends")


def verdict(page: Page, name: str) -> Locator:
    """What the panel says of a requirement."""
    return page.locator(".verdict").filter(has=page.get_by_text(name, exact=True))


async def choose(page: Page, file: Path) -> None:
    """Rehearse with a file, as a person chooses it."""
    async with page.expect_file_chooser() as chooser:
        await page.get_by_role("button", name="Answers file…").click()
    await (await chooser.value).set_files(file)


async def worst_runs(mission: Path, folder: Path) -> dict[Path, dict[str, Any]]:
    """The answers files of a campaign, each with the row of its run."""
    (folder / "faults.yaml").write_text(VARIED, encoding="utf-8")
    words = ["campaign", mission, "--fleet", FLEET, "--faults", folder / "faults.yaml"]
    words += ["--runs", 60, "--seed", 7, "--workers", 1, "--require", "soon"]
    words += ["--out", folder / "out"]
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "m2pem"),
        *map(str, words),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        cwd=REPOSITORY,
    )
    said, _ = await process.communicate()
    assert process.returncode == 0, said.decode()
    rows = {row["run"]: row for row in pq.read_table(folder / "out/runs.parquet").to_pylist()}
    files = sorted((folder / "out" / "worst").iterdir())
    return {file: rows[int(file.stem.removeprefix("run-"))] for file in files}


async def test_the_worst_runs_of_a_campaign_end_in_the_editor_as_they_did(
    desk: Desk, tmp_path: Path
) -> None:
    mission = desk.executive.missions / "vignette1.bpmn"
    mission.write_bytes(mission.read_bytes().replace(BEGIN, BEGIN + REQUIREMENTS))
    found = await worst_runs(mission, tmp_path)
    assert len(found) == 5
    page = await desk.edit(tab="Run")
    await page.set_viewport_size({"width": 1440, "height": 960})
    part = page.get_by_role("region", name="Rehearse")
    outcome = part.get_by_role("region", name="What came of it")
    for file, row in found.items():
        await choose(page, file)
        await expect(part.get_by_text(f"Of {file.name}")).to_be_visible()
        await expect(outcome).to_be_visible()
        link = outcome.get_by_role("link", name="Watch the rehearsal")
        name = str(await link.get_attribute("href")).rpartition("/")[2]
        summary = (await desk.ask("GET", f"/api/rehearsals/{name}"))["summary"]
        assert summary["status"] in OVER
        took_s = (summary["ended_us"] - summary["started_us"]) / 1e6
        assert (summary["status"], took_s) == (row["outcome"], row["took_s"])
        for requirement in VERDICTS:
            said = row[f"requirement.{requirement}"]
            await expect(verdict(page, requirement)).to_contain_text(said)
        await expect(page.locator(".verdict")).to_have_count(len(VERDICTS))
    # The form has all of the last file, too: what it writes gives the same rehearsal.
    await part.get_by_role("button", name="Back to the form").click()
    visits = part.get_by_role("group", name="USER SEND ROUTE")
    await expect(visits.get_by_label("seconds until answer 1")).not_to_have_value("")
    await expect(part.get_by_label("Vehicles, wind, incidents (YAML)")).to_have_value(
        re.compile(r"battery[\s\S]*wind")
    )
    await part.get_by_role("button", name="Rehearse", exact=True).click()
    await expect(outcome.get_by_role("link", name="Watch the rehearsal")).not_to_have_attribute(
        "href", f"/rehearsals/{name}"
    )
    link = outcome.get_by_role("link", name="Watch the rehearsal")
    again = str(await link.get_attribute("href")).rpartition("/")[2]
    repeated = (await desk.ask("GET", f"/api/rehearsals/{again}"))["summary"]
    assert {**repeated, "ended_us": 0} == {**summary, "ended_us": 0}
    assert repeated["ended_us"] == summary["ended_us"]


async def test_a_verdict_leads_to_its_moment(desk: Desk, tmp_path: Path) -> None:
    mission = desk.executive.missions / "vignette1.bpmn"
    mission.write_bytes(mission.read_bytes().replace(BEGIN, BEGIN + REQUIREMENTS))
    late = tmp_path / "late.yaml"
    late.write_text("answers: {UserSendRoute: [{decision: continue, after: 20 s}]}\n")
    page = await desk.edit(tab="Run")
    await page.set_viewport_size({"width": 1440, "height": 960})
    await choose(page, late)
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome).to_contain_text("1 requirement violated")
    entries = page.locator(".verdict")
    await expect(entries.first).to_contain_text("soon")
    await expect(verdict(page, "soon")).to_contain_text("violated since 0:12.5")
    await expect(verdict(page, "asked")).to_contain_text("satisfied since 0:20.0")
    await expect(verdict(page, "untroubled")).to_contain_text("satisfied since")
    await expect(
        verdict(page, "soon").get_by_role("button", name="USER SEND ROUTE")
    ).to_be_visible()
    await verdict(page, "soon").scroll_into_view_if_needed()
    if folder := os.environ.get("M2PEM_LOOK"):
        await page.screenshot(path=Path(folder) / "verdicts.png", animations="disabled")
    eyes = Accessibility(page)
    await eyes.look("verdicts of a rehearsal", ".m2r-outcome")
    eyes.assert_well()
    await picture(page, "rehearsed_requirements")
    time = page.locator(".player-time")
    head = verdict(page, "soon").locator("button.verdict-head")
    await expect(head).to_have_attribute("title", "Show its elements, and go to 0:12.5")
    await head.focus()
    await page.keyboard.press("Enter")
    await expect(time).to_have_text(re.compile("^0:12.5 of "))
    await expect(page.locator("[data-element-id=UserSendRoute].m2-rehearsed")).to_be_visible()
    await expect(page.locator(".player-play")).to_have_text("Play")
    await verdict(page, "asked").locator("button.verdict-head").click()
    await expect(time).to_have_text(re.compile("^0:20.0 of "))
    await expect(page.locator("[data-element-id=DriveRoute].m2-rehearsed")).to_be_visible()
    if folder:
        await page.screenshot(path=Path(folder) / "verdict-moment.png", animations="disabled")


async def test_what_is_wrong_in_an_answers_file_is_said_with_its_line(
    desk: Desk, tmp_path: Path
) -> None:
    page = await desk.edit(tab="Run")
    file = tmp_path / "wrong.yaml"
    problem = page.get_by_role("alert").filter(has_text="could not be rehearsed")
    for text, said in (
        ("answers:\n  UserSendRout: [continue]\n", ["UserSendRoute", "Line 2: UserSendRout:"]),
        ("wind: {speed: 3 m/s}\nvehicles:\n  evsg1: {batery: 40 %}\n", ["battery", "Line 3:"]),
        ("# nothing\nanswers: [continue\n", ["is not YAML", "Line 3"]),
        ("wind: }\nanswers: {}\n", ["is not YAML", "Line 1: wind: }"]),
        ("wind:\n  speed: fast\n", ["Line 2: speed: fast"]),
    ):
        file.write_text(text)
        await choose(page, file)
        for part in said:
            await expect(problem).to_contain_text(part)
        await expect(page.get_by_label("Answers file (YAML)")).to_have_value(text)
    before = await page.get_by_label("Answers file (YAML)").input_value()
    file.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    await choose(page, file)
    await expect(page.get_by_text("wrong.yaml cannot be read: it is no text")).to_be_visible()
    file.write_text("# " + 1_000_000 * "x")
    await choose(page, file)
    await expect(page.get_by_text("it is longer than 1 MB")).to_be_visible()
    await expect(page.get_by_label("Answers file (YAML)")).to_have_value(before)
