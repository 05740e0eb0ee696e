"""The work that is measured, at which sizes, and what it must reach."""

from dataclasses import dataclass

ELEMENTS_PER_S = 100_000
BRANCHES_PER_S = 60_000
SQLITE_PER_S = 50_000
LINEAR = 1.3
MEMORY_GROWTH = 1.05


@dataclass(frozen=True, slots=True)
class Work:
    """A graph that all engines play. `sizes`: the first is for a quick look; `targets` count from
    `measured_from` on."""

    name: str
    title: str
    unit: str
    sizes: tuple[int, ...]
    measured_from: int
    elements_per_s: int = ELEMENTS_PER_S


WORK = (
    Work("row", "tasks in a row", "tasks", (100, 1_000, 10_000, 100_000), 1_000),
    Work("loop", "a loop", "rounds", (100, 1_000, 10_000, 100_000, 1_000_000), 10_000),
    Work("branches", "a parallel gateway", "branches", (100, 1_000, 10_000), 1_000, BRANCHES_PER_S),
    Work("instances", "a 20-element process", "instances", (10, 100, 1_000, 10_000), 1_000),
)


@dataclass(frozen=True, slots=True)
class Goal:
    """A bound on a figure of one program; `at_least`, or else at most."""

    key: str
    title: str
    unit: str
    bound: float | None = None
    at_least: bool = False

    def met(self, value: float) -> bool | None:
        """Whether the bound is kept; None: there is none."""
        if self.bound is None:
            return None
        return value >= self.bound if self.at_least else value <= self.bound


@dataclass(frozen=True, slots=True)
class Program:
    """A program of m2pem alone: the words of its command, and those of its quick look.

    `ros`: it runs where ROS is installed.
    """

    size: str
    command: tuple[str, ...]
    quick: tuple[str, ...]
    goals: tuple[Goal, ...]
    ros: bool = False

    @property
    def name(self) -> str:
        """Its command."""
        return " ".join(self.command)


def _reading(size: int, bound: float | None) -> Program:
    goals = (
        Goal("cpu_s", "reading and checking a file", "s", bound),
        Goal("us_per_element", "the same, for an element", "us"),
    )
    command = ("reading", str(size))
    return Program(f"{size:,} elements", command, ("reading", "200"), goals)


def _reaction(journal: str, bound_ms: float) -> Program:
    sent = f"signal from outside to Arbiter.start, {journal} journal"
    thrown = f"signal thrown in the mission to Arbiter.start, {journal} journal"
    goals = (
        Goal("p50_ms", f"{sent}, p50", "ms"),
        Goal("p99_ms", f"{sent}, p99", "ms", bound_ms),
        Goal("thrown_p50_ms", f"{thrown}, p50", "ms"),
        Goal("thrown_p99_ms", f"{thrown}, p99", "ms", bound_ms),
    )
    size = "1,000 other tokens waiting"
    command = ("reaction", journal, "1000", "1000")
    return Program(size, command, ("reaction", journal, "20", "5"), goals)


def _mavlink_command(journal: str, bound_ms: float | None) -> Program:
    signal = f"signal to the MAVLink vehicle's socket, {journal} journal"
    pause = f"pause to the MAVLink vehicle's socket, {journal} journal"
    goals = (
        Goal("p50_ms", f"{signal}, p50", "ms"),
        Goal("p99_ms", f"{signal}, p99", "ms", bound_ms),
        Goal("pause_p50_ms", f"{pause}, p50", "ms"),
        Goal("pause_p99_ms", f"{pause}, p99", "ms", bound_ms),
        Goal("cpu_percent", f"an executive with all that, {journal} journal, of a core", "%"),
    )
    command = ("mavlink_command", journal, "100", "50", "500")
    quick = ("mavlink_command", "sqlite", "5", "200", "10")
    return Program("100 vehicles, 50 messages/s each", command, quick, goals)


def _web_map(vehicles: int, least_fps: float) -> Program:
    what = f"the page of a run with {vehicles:,} driving vehicles"
    return Program(
        "They send states 5 times a second; looked at in Chromium without a graphics card",
        ("web_map", str(vehicles), "30"),
        ("web_map", "10", "1"),
        (
            Goal("fps", f"{what}, pictures drawn", "/s", least_fps, at_least=True),
            Goal("told_per_s", f"{what}, frames told to it", "/s"),
            Goal("longest_ms", f"{what}, the longest time between two pictures", "ms"),
            Goal("cpu_percent", f"{what}, the page's process, of a core", "%"),
        ),
    )


def _ros_command(journal: str, bound_ms: float | None) -> Program:
    signal = f"signal to the ROS vehicle's callback, {journal} journal"
    pause = f"pause to the ROS vehicle's callback, {journal} journal"
    goals = (
        Goal("p50_ms", f"{signal}, p50", "ms", bound_ms),
        Goal("p95_ms", f"{signal}, p95", "ms"),
        Goal("pause_p50_ms", f"{pause}, p50", "ms"),
        Goal("pause_p95_ms", f"{pause}, p95", "ms"),
        Goal("cpu_percent", f"an executive with all that, ROS, {journal} journal, of a core", "%"),
    )
    command = ("ros_command", journal, "20", "500")
    quick = ("ros_command", "sqlite", "2", "3")
    return Program("20 vehicles, 10 messages/s each", command, quick, goals, ros=True)


def _team_orders(journal: str) -> Program:
    orders = {"start": None, "hold": 200, "resume": 200, "cancel": 200}
    goals = [
        goal
        for order, bound_ms in orders.items()
        for goal in (
            Goal(f"{order}_p50_ms", f"{order} to a team's last member, {journal} journal", "ms"),
            Goal(f"{order}_max_ms", "the same, the longest of 100", "ms", bound_ms),
        )
    ]
    command = ("team_orders", journal, "5", "5", "100")
    quick = ("team_orders", "sqlite", "2", "2", "1")
    size = "5 ROS and 5 MAVLink members, 10 and 50 messages/s each"
    return Program(size, command, quick, tuple(goals), ros=True)


def _ros_discovery(count: int) -> Program:
    goals = (
        Goal("all_s", "ROS, from connect until all are heard", "s"),
        Goal("late_s", "ROS, from a vehicle's beginning to its first command", "s"),
    )
    command, quick = ("ros_discovery", str(count)), ("ros_discovery", "1")
    return Program(f"{count} vehicle{'s' * (count > 1)}", command, quick, goals, ros=True)


FACES = "otlp,prometheus,recorder,foxglove,mavlink,cot"


def _face_latency(kind: str, title: str) -> Program:
    goals = (Goal("p50_ms", f"{title}, p50", "ms"), Goal("p99_ms", f"{title}, p99", "ms"))
    command, quick = ("face_latency", kind, "60"), ("face_latency", kind, "2")
    return Program("1 vehicle, 10 positions/s", command, quick, goals, ros=True)


def _face_load(faces: str) -> Program:
    goals = (
        Goal("lost", f"faces {faces}: MAVLink messages lost", "", 0),
        Goal("messages_per_s", "the same, MAVLink messages", "/s"),
        Goal("states_per_s", "the same, states on the fleet bus", "/s"),
        Goal("longest_s", "the same, longest time without a state of a vehicle", "s"),
        Goal("cpu_percent", "the same, of a core", "%"),
        Goal("peak_mb", "the same, memory", "MB"),
    )
    command = ("face_load", "600", "50", "100", "10", "60", faces)
    quick = ("face_load", "5", "50", "2", "10", "1", faces)
    size = "600 MAVLink vehicles, 50 messages/s, 100 ROS vehicles, 10 Hz"
    return Program(size, command, quick, goals, ros=True)


PROGRAMS = (
    Program(
        "100 runs",
        ("answering", "100", "100"),
        ("answering", "5", "5"),
        (
            Goal("inputs_per_s", "SQLite, an input an element", "/s", 5_000, at_least=True),
            Goal("commits_per_input", "commits an input", "", 0.05),
        ),
    ),
    Program(
        "1 run",
        ("answering", "1", "500"),
        ("answering", "1", "5"),
        (
            Goal("fsync_ms", "an fsync, in the same place", "ms"),
            Goal("fsyncs_per_input", "SQLite, time of an input, in fsyncs", "", 1.2),
            Goal("beyond_fsync_ms", "SQLite, time of an input beyond an fsync", "ms"),
        ),
    ),
    Program(
        "100,000 instances",
        ("waiting", "100000"),
        ("waiting", "100"),
        (Goal("bytes", "memory of a waiting 20-element instance", "bytes", 6_000),),
    ),
    _reading(5_000, 0.15),
    _reading(20_000, None),
    _reading(100_000, None),
    _reaction("memory", 5),
    _reaction("sqlite", 15),
    Program(
        "100,000 rounds",
        ("replaying", "100000"),
        ("replaying", "100"),
        (
            Goal("records_per_s", "replay, records in memory", "/s", 200_000, at_least=True),
            Goal("from_sqlite_per_s", "replay, out of SQLite", "/s", 200_000, at_least=True),
        ),
    ),
    Program(
        "",
        ("starting", "5"),
        ("starting", "1"),
        (
            Goal("help_s", "CPU of m2pem --help", "s", 0.25),
            Goal("check_s", "CPU of m2pem check, a small file", "s", 0.5),
            Goal("check_fleet_s", "CPU of m2pem check with a fleet, a small file", "s"),
            Goal("simulate_s", "CPU of m2pem simulate, a small file", "s"),
        ),
    ),
    Program(
        "without the start-up",
        ("command_line", "32000", "16000", "5"),
        ("command_line", "100", "50", "1"),
        (
            Goal("row_per_s", "m2pem run, 32,000 tasks in a row", "elements/s", 25_000, True),
            Goal("branches_per_s", "m2pem run, 16,000 branches", "elements/s", 15_000, True),
        ),
    ),
    Program(
        "1,000 tokens waiting",
        ("idle", "1000", "10"),
        ("idle", "20", "0.2"),
        (Goal("percent", "an idle executive, of a core", "%", 0.1),),
    ),
    Program(
        "200 tasks, 1,000 vehicles",
        ("allocating", "200", "1000", "100", "500"),
        ("allocating", "10", "20", "2", "12"),
        (
            Goal("decision_ms", "choosing vehicles for 200 tasks of one moment, CPU", "ms", 200),
            Goal("missions_cpu_s", "100 missions at once on 500 simulated vehicles, CPU", "s"),
            Goal("completed", "the same, runs that complete", "", 100, at_least=True),
            Goal("heavy_wait_s", "the same, longest wait for a scarce vehicle, mission time", "s"),
            Goal("heavy_bound_s", "the same, the bound on that", "s"),
            Goal("light_wait_s", "the same, longest wait for another vehicle", "s"),
            Goal("light_bound_s", "the same, the bound on that", "s"),
        ),
    ),
    Program(
        "20,000 frames",
        ("mavlink_frames", "20000"),
        ("mavlink_frames", "500"),
        (
            Goal("frames_per_s", "MAVLink datagrams routed, 11 kinds decoded", "/s"),
            Goal("times", "the same, times pymavlink's speed", "", 6, at_least=True),
            Goal("stream_frames_per_s", "MAVLink frames of a stream, the same", "/s"),
            Goal("stream_times", "the same, times pymavlink's speed", "", 3, at_least=True),
            Goal("signed_frames_per_s", "MAVLink datagrams, signatures checked, the same", "/s"),
            Goal("signed_times", "the same, times pymavlink's speed", "", 4, at_least=True),
        ),
    ),
    Program(
        "300 vehicles, 50 messages/s each, 60 s",
        ("mavlink_gateway", "load", "300", "50", "60"),
        ("mavlink_gateway", "load", "300", "50", "1"),
        (
            Goal("lost", "MAVLink over UDP, lost messages", "", 0),
            Goal("messages_per_s", "MAVLink over UDP, messages", "/s"),
            Goal("cpu_percent", "MAVLink over UDP, of a core", "%", 25),
            Goal("peak_mb", "MAVLink over UDP, memory", "MB", 64),
        ),
    ),
    Program(
        "100 vehicles, 50 messages/s each",
        ("mavlink_gateway", "latency", "100", "50", "10"),
        ("mavlink_gateway", "latency", "20", "50", "1"),
        (
            Goal("p50_ms", "MAVLink command to the vehicle's socket, p50", "ms"),
            Goal("p99_ms", "MAVLink command to the vehicle's socket, p99", "ms", 5),
        ),
    ),
    _mavlink_command("memory", 5),
    _mavlink_command("sqlite", None),
    Program(
        "302 elements, 10,000 token events/s or more, three browsers of which one never reads",
        ("web", "60"),
        ("web", "0.3", "1"),
        (
            Goal("ratio", "an engine with the page, times its speed without", "", 0.95, True),
            Goal("per_s", "the page, token events, all of them counted", "/s"),
            Goal("frames_per_s", "the page, frames to a browser", "/s", 24, at_least=True),
            Goal("frame_p50_ms", "the page, from a frame's making to the browser, p50", "ms"),
            Goal("frame_p99_ms", "the page, from a frame's making to the browser, p99", "ms"),
            Goal("event_p50_ms", "the page, from an event to the browser, p50", "ms"),
            Goal("event_p99_ms", "the page, from an event to the browser, p99", "ms"),
            Goal("cpu_percent", "an executive with the page, of a core", "%"),
            Goal("alone_cpu_percent", "the same without the page, of a core", "%"),
        ),
    ),
    Program(
        "The same, looked at in Chromium as well, which draws without a graphics card",
        ("web_page", "60"),
        ("web_page", "1"),
        (
            Goal("fps", "the page, pictures drawn", "/s", 25, at_least=True),
            Goal("told_per_s", "the page, frames told to it", "/s", 24, at_least=True),
            Goal("per_s", "the page, token events, all of them counted", "/s"),
            Goal("longest_ms", "the page, the longest time between two pictures", "ms"),
        ),
    ),
    Program(
        "The same diagram, 50 browsers and two tabs of Chromium",
        ("web_crowd", "60"),
        ("web_crowd", "0.5", "1", "4", "0"),
        (
            Goal("ratio", "an engine with 50 browsers, times its speed without", "", 0.95, True),
            Goal("records_per_s", "50 browsers, records, all counted by each", "/s", 10_000, True),
            Goal("frames_per_s", "50 browsers, frames to the slowest", "/s"),
            Goal("event_p50_ms", "50 browsers, from an event to the slowest, p50", "ms"),
            Goal("event_p99_ms", "50 browsers, from an event to the slowest, p99", "ms"),
            Goal("us_per_record", "50 browsers, CPU of the executive for a record", "us"),
            Goal("alone_us_per_record", "the same without the page", "us"),
            Goal("peak_mb", "50 browsers, memory of the executive", "MB"),
            Goal("tab_fps", "50 browsers, pictures that a tab draws", "/s"),
            Goal("tab_told_per_s", "50 browsers, frames to a tab", "/s"),
        ),
    ),
    _web_map(100, 30),
    _web_map(1000, 10),
    Program(
        "An ended run of 1.5 million records, at its end and at 20 other moments, in Chromium",
        ("web_replay", "1500000", "20"),
        ("web_replay", "10000", "2"),
        (
            Goal("open_s", "the page of an ended run, until all is drawn", "s", 2),
            Goal("seek_p50_ms", "the same, to another moment, p50", "ms"),
            Goal("seek_max_ms", "the same, the longest", "ms", 500),
            Goal("open_mb", "the same, sent to open it", "MB"),
            Goal("seek_mb", "the same, sent for another moment", "MB"),
            Goal("heap_mb", "the same, the heap of the page", "MB"),
            Goal("first_s", "the same, opened first: its index is made", "s"),
            Goal("making_late_ms", "the event loop meanwhile, at most late", "ms"),
        ),
    ),
    Program(
        "a run that never waits, all faces but ros",
        ("faces", "cost", FACES, "3000", "3"),
        ("faces", "cost", "mavlink", "50", "1"),
        (
            Goal("us", "a record until all faces have it, CPU", "us"),
            Goal("alone_us", "the same without faces", "us"),
        ),
    ),
    Program(
        "3,000 token events/s, all faces but ros, of which no reader reads",
        ("faces", "stalled", FACES, "60"),
        ("faces", "stalled", "prometheus,foxglove,mavlink,cot", "1", "1"),
        (
            Goal("ratio", "an engine with stalled faces, times its speed without", "", 0.95, True),
            Goal("records_per_s", "the same, records", "/s"),
            Goal("cpu_percent", "an executive with stalled faces, of a core", "%"),
            Goal("alone_cpu_percent", "the same without faces, of a core", "%"),
        ),
    ),
    _ros_command("memory", 3),
    _ros_command("sqlite", None),
    _face_latency("udp", "MAVLink position to another program's socket, without m2pem"),
    _face_latency("mavlink_ros", "MAVLink position to a subscriber of /v0/odom"),
    _face_latency("ros", "ROS odometry to another node's callback, without m2pem"),
    _face_latency("ros_mavlink", "ROS odometry to a ground station's GLOBAL_POSITION_INT"),
    _face_load("none"),
    _face_load("ros"),
    _team_orders("memory"),
    _team_orders("sqlite"),
    Program(
        "100 vehicles, odometry and status at 10 Hz, 30 s",
        ("ros_fleet", "100", "10", "30"),
        ("ros_fleet", "2", "10", "0.5"),
        (
            Goal("states_per_s", "ROS, states that arrive on the fleet bus", "/s"),
            Goal("longest_s", "ROS, longest time without a state of the same vehicle", "s", 1),
            Goal("cpu_percent", "ROS, of a core", "%"),
            Goal("peak_mb", "ROS, memory", "MB"),
        ),
        ros=True,
    ),
    _ros_discovery(1),
    _ros_discovery(20),
    _ros_discovery(100),
    Program(
        "with the wheels of ROS",
        ("starting", "5", "help"),
        ("starting", "1", "help"),
        (Goal("help_s", "CPU of m2pem --help", "s"),),
        ros=True,
    ),
)
