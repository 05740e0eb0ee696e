"""The requirements of a run in the terminal: what is violated, open and satisfied."""

from terminal_world import MISSION, World, scout

REQUIREMENTS = """<extensionElements>
  <m2pem:requirement id="charged" ltl="[] battery(scout) &gt; 50 %"/>
  <m2pem:requirement id="near" ltl="&lt;&gt; distance(scout, uav) &lt; 5 m"/>
  <m2pem:requirement id="runs" ltl="&lt;&gt; !ended"/>
</extensionElements>"""


def monitored() -> bytes:
    """The mission with three requirements."""
    source = MISSION.read_text(encoding="utf-8")
    begin = source.index(">", source.index("<process ")) + 1
    return (source[:begin] + REQUIREMENTS + source[begin:]).encode()


async def test_the_list_says_what_is_violated_and_of_what_nothing_is_known(world: World) -> None:
    await world.control.start(monitored())
    async with world.terminal() as terminal:
        world.fake.say(scout(0.45))
        await terminal.until_shown("1 violated (v)")
        await terminal.press("v")
        await terminal.until_shown(
            "Requirements",
            "violated since 0.0 s  charged",
            "Always battery(scout) > 50 %.",
            "not battery(scout) > 50 %",
            "open  near",
            "nothing is known of the distance of scout and uav",
            "satisfied since 0.0 s  runs",
        )
        screen = terminal.screen
        assert (
            screen.index("charged") < screen.index("open  near") < screen.index("satisfied since")
        )


async def test_a_run_without_requirements_says_so(world: World) -> None:
    run = await world.start()
    async with world.terminal() as terminal:
        await terminal.until_shown(run)
        assert not terminal.shows("(v)")
        await terminal.press("v")
        await terminal.until_shown(f"{run} is monitored for no requirement.")
