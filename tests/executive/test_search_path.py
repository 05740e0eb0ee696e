"""Missions that come as bytes, and what they call in the folders of the executive."""

from pathlib import Path

from m2pem.api.authoring import Draft
from m2pem.api.runs import RunStatus
from m2pem.journal import MemoryJournal

from .conftest import World, mission, question, sequence

CALL = sequence(("Call", '<callActivity id="Call" calledElement="SEARCH"/>'))
SEARCH = '<process id="SEARCH"><task id="Look"/></process>'


def test_a_mission_that_came_as_bytes_calls_what_is_in_the_folders(play, tmp_path: Path) -> None:
    (tmp_path / "search.bpmn").write_bytes(mission(SEARCH))

    async def story(world: World):
        control = world.executive.control
        assert control.check(mission(CALL)) == []
        run = await control.start(mission(CALL))
        return await control.wait(run), await control.mission(run)

    summary, loaded = play(story, search_path=[tmp_path])
    assert summary.status is RunStatus.COMPLETED
    assert "search:Look" in loaded.elements


def test_a_mission_of_the_journal_has_the_files_that_it_had(play, tmp_path: Path) -> None:
    journal = MemoryJournal()
    file = tmp_path / "search.bpmn"
    file.write_bytes(mission(SEARCH))

    async def story(world: World):
        run = await world.executive.control.start(mission(CALL))
        await world.executive.control.wait(run)

    play(story, journal=journal, search_path=[tmp_path])
    file.unlink()

    async def later(world: World):
        return await world.executive.control.mission("r1")

    assert "search:Look" in play(later, journal=journal).elements


def test_a_mission_that_calls_what_is_nowhere_says_where_it_was_looked_for(
    play, tmp_path: Path
) -> None:
    async def story(world: World):
        return world.executive.control.check(mission(CALL))

    [finding] = play(story, search_path=[tmp_path])
    assert str(tmp_path) in finding.message


def test_a_check_knows_what_is_given_at_start(play) -> None:
    routed = '<scriptTask id="T"><script>done = mission.pace</script></scriptTask>'

    async def story(world: World):
        check = world.executive.control.check
        source = mission(sequence(("T", routed)))
        given = check(source, data=["mission.pace"])
        return check(source), given, check(source, process="Q", data=["mission.pace"])

    unknown, given, elsewhere = play(story)
    assert ["mission.pace" in each.message for each in unknown] == [True]
    assert given == []
    assert [each.rule for each in elsewhere] == ["unknown-process"]


def test_a_rehearsal_beside_missions_has_the_path_too(play, tmp_path: Path) -> None:
    (tmp_path / "search.bpmn").write_bytes(mission(SEARCH))
    given = []

    async def rehearse(_mission, _fleet, **options):
        given.append(options["search_path"])

    async def story(world: World):
        await world.executive.control.simulate(mission(sequence(("Ask", question("Ask")))))

    play(story, search_path=[tmp_path], rehearse=rehearse)
    assert given == [(tmp_path,)]


def test_a_draft_calls_what_is_beside_the_place_it_is_for(play, tmp_path: Path) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / "search.bpmn").write_bytes(mission(SEARCH))

    async def story(world: World):
        control = world.executive.control
        draft = Draft(folder / "new.bpmn", mission(CALL))
        await control.wait(await control.start(draft))
        alone = [each.rule for each in control.check(mission(CALL))]
        return alone, list(control.check(draft)), (await control.runs())[0].mission

    alone, beside, called = play(story)
    assert alone == ["dangling-reference"] and beside == []
    assert called == str(folder / "new.bpmn")


def test_a_draft_imports_nothing_from_elsewhere(play, tmp_path: Path) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    (tmp_path / "secret.bpmn").write_bytes(mission(SEARCH))
    namespace = "http://www.omg.org/spec/BPMN/20100524/MODEL"
    source = mission(
        f'<import importType="{namespace}" location="../secret.bpmn" namespace="x"/>'
        + sequence(("Ask", question("Ask")))
    )

    async def story(world: World):
        return world.executive.control.check(Draft(folder / "new.bpmn", source))

    assert "import-unreadable" in [each.rule for each in play(story)]


def test_missions_are_found_on_the_search_path_in_the_working_folder_and_in_missions(
    play, tmp_path: Path, monkeypatch
) -> None:
    folders = [tmp_path / "named", tmp_path / "here", tmp_path / "here" / "missions"]
    for folder in folders:
        folder.mkdir()
        (folder / f"in_{folder.name}.bpmn").write_bytes(mission(SEARCH))
    task_alone = mission('<globalTask id="Ask"/>')
    (folders[1] / "task_alone.bpmn").write_bytes(task_alone)
    (folders[1] / "no_xml.bpmn").write_text("no XML", "utf-8")
    (folders[1] / "notes.txt").write_text("no mission", "utf-8")
    monkeypatch.chdir(folders[1])

    async def story(world: World):
        return await world.executive.control.missions()

    found = play(story, search_path=[folders[0], folders[2]])
    names = ["in_named.bpmn", "in_missions.bpmn", "in_here.bpmn", "no_xml.bpmn"]
    assert [Path(each).name for each in found] == names
    assert all(Path(each).is_absolute() for each in found)


def test_a_preview_of_a_start_has_findings_roles_and_who_has_what(play, tmp_path: Path) -> None:
    file = tmp_path / "search.bpmn"
    file.write_bytes(mission(SEARCH))

    async def story(world: World):
        control = world.executive.control
        missing = await control.preview_start(tmp_path / "missing.bpmn")
        unknown = await control.preview_start(file, process="OTHER")
        return missing, await control.preview_start(file), unknown

    missing, preview, unknown = play(story)
    assert (missing.refused, missing.findings[0].rule) == (True, "unreadable-file")
    assert (preview.refused, preview.process, preview.roles, preview.busy) == (
        False,
        "SEARCH",
        (),
        "",
    )
    assert (unknown.refused, unknown.process) == (True, "OTHER")
