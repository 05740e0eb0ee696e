"""Questions and their answers, with one operator and with several."""

from terminal_world import MISSION, World


async def test_a_key_answers_the_question_that_is_shown(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("Question 1 of 2: GATE (", "Is the gate open?")
        assert terminal.line("It is open") == "  1  It is open    2  It is closed"
        await terminal.press("2")
        await terminal.until_shown("GATE: no, answered by anna@gcs1", "Question: BRIDGE")
    written = [str(each.record) for each in await world.control.records(run)]
    assert any("PromptAnswered" in text and "anna@gcs1" in text for text in written)


async def test_tab_turns_to_the_next_question_and_back(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("Question 1 of 2: GATE (")
        await terminal.press("tab")
        await terminal.until_shown("Question 2 of 2: BRIDGE", "Can the bridge be crossed?")
        await terminal.press("1")
        await terminal.until_shown("BRIDGE: cross, answered by anna@gcs1", "Question: GATE")


async def test_a_key_without_a_decision_does_nothing(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("Question 1 of 2: GATE (")
        await terminal.press("3")
        await terminal.until_shown("Question 1 of 2: GATE (")
        assert len(world.control.prompts()) == 2


async def test_a_key_meant_for_the_question_before_is_not_taken(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("Question 1 of 2: GATE (")
        first = next(each for each in world.control.prompts() if each.element == "Gate")
        world.hand.now_s += 10
        await world.control.answer(run, first.prompt, "no", by="bob@gcs2")
        await terminal.until_shown("Question: BRIDGE")
        await terminal.pilot.press("1")
        await terminal.until_shown("only just appeared")
        assert [each.element for each in world.control.prompts()] == ["Bridge"]
        await terminal.press("1")
        await terminal.until(lambda: not world.control.prompts())


async def test_the_first_of_two_operators_wins_and_the_other_is_told(world: World) -> None:
    async with world.terminal("anna@gcs1") as anna, world.terminal("bob@gcs2") as bob:
        await world.start()
        await anna.until_shown("Question 1 of 2: GATE (")
        await bob.until_shown("Question 1 of 2: GATE (")
        await bob.press("2")
        await anna.until_shown("bob@gcs2 answered GATE: It is closed", "Question: BRIDGE")
        await bob.until_shown("GATE: no, answered by bob@gcs2", "Question: BRIDGE")
        assert not bob.shows("answered GATE")


async def test_an_answer_that_comes_too_late_is_told(world: World) -> None:
    async with world.terminal("anna@gcs1") as anna:
        run = await world.start()
        await anna.until_shown("Question 1 of 2: GATE (")
        prompt = anna.app.prompt_pane.current
        assert prompt is not None
        world.hand.now_s += 1
        anna.app.action_answer(1)  # and, before it is sent, another operator does
        await world.control.answer(run, prompt.prompt, "no", by="bob@gcs2")
        await anna.until_shown("GATE: no, answered by bob@gcs2")
        await anna.until(lambda: anna.shows("Not taken") or anna.shows("bob@gcs2 answered"))


async def test_a_question_that_was_open_before_is_shown(world: World) -> None:
    await world.start()
    async with world.terminal() as terminal:
        await terminal.until_shown("Question 1 of 2: GATE (", "GATE asks: Is the gate open?")


async def test_a_long_question_leaves_its_decisions_in_sight(world: World) -> None:
    text = "word " * 300
    long = MISSION.read_bytes().replace(b"Is the gate open?", text.encode())
    async with world.terminal() as terminal:
        await world.control.start(long)
        await terminal.until_shown("word word", "It is open", "It is closed", "STOP")
