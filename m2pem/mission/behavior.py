"""What tasks carry: behaviors (paper, Figure 3), prompts, service calls, assignments."""

from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.mission.expression import Expression


class BehaviorType(StrEnum):
    """What a behavior commands: the paper's Vehicle and Payload tasks, and teams of vehicles."""

    VEHICLE = "vehicle"
    PAYLOAD = "payload"
    TEAM = "team"


class RoleKind(StrEnum):
    """The kind of resource that a role allocates."""

    VEHICLE = "vehicle"
    PAYLOAD = "payload"
    TEAM = "team"


class OnLoss(StrEnum):
    """What becomes of the rest of a behavior whose vehicle or payload is lost: its task ends with
    the error, another one that fills the role does the rest, or an operator is asked."""

    FAIL = "fail"
    REASSIGN = "reassign"
    ASK = "ask"


class Keep(StrEnum):
    """Until when the run keeps what fills a role, also between tasks: until the process, or the
    subprocess, that the task is in ends; or only until the task ends, also if an earlier task has
    kept it for longer."""

    PROCESS = "process"
    SUBPROCESS = "subprocess"
    TASK = "task"


@dataclass(frozen=True, slots=True)
class Need:
    """What a role asks of the resources that fill it; they are chosen when its task starts.

    `condition`: read for each candidate, over its facts and the data store; None: every candidate
    that offers the behavior may fill the role. `least`, `most`: how many fill it. `preference`: how
    many seconds of travel time a candidate is worth. `same`: the name of data with the resources of
    an earlier role. `store`: the name under which the chosen resources are stored. `waits`: whether
    the task waits until they are free, for `wait_limit` (an ISO 8601 duration) or without a limit.
    `priority`: of what waits, the highest comes first.
    """

    condition: Expression | None = None
    least: int = 1
    most: int = 1
    preference: Expression | None = None
    same: str = ""
    store: str = ""
    waits: bool = False
    wait_limit: Expression | None = None
    priority: int = 0

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The expressions that are read for each candidate."""
        return tuple(each for each in (self.condition, self.preference) if each is not None)


@dataclass(frozen=True, slots=True)
class Role:
    """One role of a behavior and what fills it.

    `resource` is the id in the fleet: a vehicle ("evsg1"), a payload ("evsg2/ptz") or a team; ""
    for a role by need. `need` None: the resource is allocated at once or not at all. `on_loss`:
    what is done when what fills it is lost. `keep`: until when the run keeps it; None: nothing
    changes about that, and what is not kept is free when the task ends.
    """

    name: str
    kind: RoleKind
    resource: str
    line: int
    optional: bool = False
    need: Need | None = None
    on_loss: OnLoss = OnLoss.FAIL
    keep: Keep | None = None


@dataclass(frozen=True, slots=True)
class Parameter:
    """A key-value parameter of a behavior.

    `value` is the text as written ("5 m/s", "route_alpha"), or an expression that is read from
    the data store when the task starts (`${mission.speed}`).
    """

    name: str
    value: str | Expression
    line: int


@dataclass(frozen=True, slots=True)
class Behavior:
    """A behavior that a task commands: which, with what parameters, on what resources."""

    type: BehaviorType
    name: str
    line: int
    parameters: tuple[Parameter, ...] = ()
    roles: tuple[Role, ...] = ()

    @property
    def allocated_at_start(self) -> bool:
        """Whether a role is filled, waited for or kept when the task starts."""
        return any(role.need is not None or role.keep is not None for role in self.roles)


@dataclass(frozen=True, slots=True)
class Assignment:
    """`key = expression`."""

    key: str
    expression: Expression
    line: int


@dataclass(frozen=True, slots=True)
class ThrowError:
    """`throw error CODE`."""

    code: str
    line: int


@dataclass(frozen=True, slots=True)
class Script:
    """Statements of a script task (`scriptFormat="m2pem"`), run in order."""

    statements: tuple[Assignment | ThrowError, ...]


@dataclass(frozen=True, slots=True)
class Decision:
    """One choice of a prompt: `value` is stored, `label` is shown."""

    value: str
    label: str


@dataclass(frozen=True, slots=True)
class Prompt:
    """What a user task asks an operator (paper, section 4.1).

    `store`: the key that receives the decision's value. `timeout`: ISO 8601 duration after which
    the task ends with error PROMPT_TIMEOUT. `role`: which operator role may answer ("" = any).
    """

    text: str
    decisions: tuple[Decision, ...]
    store: str = "user.decision"
    role: str = ""
    timeout: Expression | None = None


@dataclass(frozen=True, slots=True)
class ServiceCall:
    """A service task's registered class (paper, section 4.1), its roles and properties."""

    service: str
    line: int
    roles: tuple[Role, ...] = ()
    properties: tuple[Parameter, ...] = ()


@dataclass(frozen=True, slots=True)
class Mapping:
    """One value passed into or out of a called process."""

    source: Expression
    target: str
    line: int


@dataclass(frozen=True, slots=True)
class Mappings:
    """The values that pass into and out of a call activity; no other value does. Of other
    activities and events: what their data associations pass, or other engines' mappings.

    `ordered`: each reads what those before it have set. `keeps_result`: what the activity's own
    work gives stays inside, where its outputs read it.
    """

    inputs: tuple[Mapping, ...] = field(default=())
    outputs: tuple[Mapping, ...] = field(default=())
    ordered: bool = False
    keeps_result: bool = False
