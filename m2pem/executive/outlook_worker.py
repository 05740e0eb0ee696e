"""The subprocess that explores what follows a choice about an incident, or a revision."""

from collections.abc import Sequence

import msgspec

from m2pem.api.runs import IncidentPreview, IncidentVerdict
from m2pem.engine.inputs import Input, ResolveIncident, Revise
from m2pem.engine.run import MissionRun
from m2pem.executive.subprocess_worker import SendProgress, run_in_subprocess, serve
from m2pem.fleet.fleet import Fleet, dump, restore
from m2pem.journal.base import Entry
from m2pem.journal.codec import decode_body, encode_body
from m2pem.mission.library import KeptLibrary, Source
from m2pem.mission.mission import Mission


class Order(msgspec.Struct):
    """A run as its journal has it, and the choice. `bodies`: its entries, encoded. `now_us`:
    microseconds since the Unix epoch. `writers`: names of behaviors that write data."""

    run: str
    file: str
    source: bytes
    library: tuple[Source, ...]
    fleet: bytes
    bodies: list[bytes]
    choice: bytes
    now_us: int
    writers: list[str]


async def outlook_in_subprocess(
    run: str,
    mission: Mission,
    fleet: Fleet,
    entries: Sequence[Entry],
    choice: ResolveIncident | Revise,
    now_us: int,
    writers: Sequence[str],
) -> IncidentPreview:
    """Return what follows a choice about an incident of a run, or a revision of its mission, and
    for its requirements, explored in a subprocess.

    `mission`: with which the run began. `entries`: all of the run's, from its journal. Other
    arguments as in `Order`.
    """
    order = Order(
        run,
        mission.file,
        mission.source,
        mission.library,
        dump(fleet),
        [encode_body(entry) for entry in entries],
        msgspec.json.encode(choice),
        now_us,
        list(writers),
    )
    answer = await run_in_subprocess(__name__, msgspec.msgpack.encode(order))
    return msgspec.msgpack.decode(answer, type=IncidentPreview)


def _work(content: bytes, _: SendProgress) -> bytes:
    # What explores is loaded here: the executive has no use for it.
    from m2pem.bpmn import parse_mission  # noqa: PLC0415
    from m2pem.monitors.requirement_outlook import OpenRequirements  # noqa: PLC0415
    from m2pem.verify.outlook import outlook  # noqa: PLC0415

    order = msgspec.msgpack.decode(content, type=Order)
    library = KeptLibrary(order.library)
    mission = parse_mission(order.source, order.file, library, accepted=True)
    fleet = restore(order.fleet)
    run = MissionRun(mission, fleet, order.run)
    requirements = OpenRequirements(run.state, fleet)
    for body in order.bodies:
        item, records = decode_body(body)
        run.replay(records, item)
        requirements.observe(records)
    choice = msgspec.json.decode(order.choice, type=Input)
    assert isinstance(choice, ResolveIncident | Revise)
    writers = frozenset(order.writers)
    found = outlook(run, order.now_us, choice, writers=writers, reader=requirements)
    judged = requirements.judge(found.explored)
    preview = IncidentPreview(IncidentVerdict(found.verdict), found.reason, judged)
    return msgspec.msgpack.encode(preview)


if __name__ == "__main__":
    serve(_work)
