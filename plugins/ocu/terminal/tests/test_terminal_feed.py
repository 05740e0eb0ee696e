"""Following runs: late, too slow, and through what others do."""

from m2pem_plugin_terminal.feed import Feed
from m2pem_plugin_terminal.story import Line
from terminal_world import Hand, World

from m2pem.api.control import MissionControl, OpenPrompt, PromptClosed, RunId
from m2pem.errors import OperatorError


class Heard:
    """Notes what the feed tells."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def logged(self, run: RunId, line: Line) -> None:
        self.told.append(line.text)

    def asked(self, prompt: OpenPrompt) -> None:
        self.told.append(f"asked {prompt.element}")

    def answered(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        self.told.append(f"answered {prompt.element} {closed.by}")

    def began(self, run: RunId) -> None:
        self.told.append(f"began {run}")

    def ended(self, run: RunId) -> None:
        self.told.append(f"ended {run}")


class SlowReader:
    """A control whose first subscriber is cut off, as one that is too slow would be."""

    def __init__(self, control: MissionControl, meanwhile: str) -> None:
        self._control = control
        self._meanwhile = meanwhile
        self.subscriptions = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._control, name)

    async def subscribe(self):  # type: ignore[no-untyped-def]
        self.subscriptions += 1
        if self.subscriptions == 1:
            await self._control.pause(self._meanwhile, by="bob")
            raise OperatorError("the subscriber fell behind")
        for prompt in self._control.prompts():
            yield prompt


async def test_who_comes_late_sees_all_that_was(world: World) -> None:
    run = await world.start()
    await world.control.pause(run, by="bob")
    heard = Heard()
    feed = Feed(world.control, heard, Hand().now)
    board = await feed.load(run)
    assert board.status == "paused"
    assert [board.label(each.element) for each in board.active.values()] == [
        "DRIVE",
        "GATE",
        "BRIDGE",
        "WATCH",
        "five minutes",
    ]
    assert [line.text for line in feed.logs[run]][-1] == "paused by bob"
    assert heard.told == [f"began {run}"]


async def test_what_was_missed_is_read_again(world: World) -> None:
    run = await world.start()
    control = SlowReader(world.control, run)
    feed = Feed(control, Heard(), Hand().now)  # type: ignore[arg-type]
    await feed.follow()
    assert control.subscriptions == 2
    assert feed.boards[run].status == "paused"
    assert len(feed.prompts) == 2
    texts = [line.text for line in feed.logs[run]]
    assert texts.count("mission started") == 1
