"""Reading all parameters (mavlink.io, "Parameter Protocol", services/parameter.html, "Read All
Parameters"): the list, and then what of it was lost."""

from itertools import islice

from m2pem_plugin_mavlink.microservices.parameter_values import (
    Parameter,
    ParameterEncoding,
    parameter_of,
)
from m2pem_plugin_mavlink.microservices.parameters import read_request
from m2pem_plugin_mavlink.microservices.patience import Patience
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, Transaction

LIST_PATIENCE = Patience(tries=5, answer_s=1.5)
"""For the first one, and between one and the next; then the missing ones are asked for."""

GAP_PATIENCE = Patience(tries=6, answer_s=1.0)
GAPS_AT_ONCE = 20
BASE_S = 60.0
PER_PARAMETER_S = 0.5
MOST = 10_000
"""What says that it has more is not believed; autopilots have some 1,500."""

_LIST = message_type("PARAM_REQUEST_LIST")
_VALUE = message_type("PARAM_VALUE")


class ReadParameters(Transaction[dict[str, Parameter]]):
    """All parameters of a component, by name.

    Fails with `NoAnswerError`, or `ExchangeError` for a count that cannot be; at the latest after
    `BASE_S` and `PER_PARAMETER_S` for each parameter.
    """

    wants = frozenset({_VALUE.id})

    def __init__(
        self, target: Address, encoding: ParameterEncoding = ParameterEncoding.C_CAST
    ) -> None:
        super().__init__(("parameters", target))
        self.target, self.encoding = target, encoding
        self._ends_s = self._began_s = 0.0
        self._tries = 0
        self._count = 0
        self._had: dict[int, Parameter] = {}
        self._asked: set[int] = set()

    def begin(self, now_s: float) -> None:
        """Ask for all."""
        self._began_s = now_s
        self._ends_s = now_s + BASE_S
        self._ask(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """A parameter. One that is not of the list, but was read or set, comes without an index."""
        if self.done or sender != self.target:
            return
        parameter = parameter_of(message, self.encoding)
        if parameter.index is None:
            return
        if parameter.count > MOST:
            self._give_up(ExchangeError, f"{parameter.count} of them cannot be")
            return
        if parameter.count != self._count:  # some parameters bring others with them
            self._count = parameter.count
            self._ends_s = self._began_s + BASE_S + PER_PARAMETER_S * self._count
            self._had = {n: each for n, each in self._had.items() if n < self._count}
        self._had[parameter.index] = parameter
        if len(self._had) == self._count:
            self.succeed({each.name: self._had[n] for n, each in sorted(self._had.items())})
        elif not self._asked:
            self.deadline_s = min(now_s + LIST_PATIENCE.answer_s, self._ends_s)
        elif parameter.index in self._asked:
            self._asked.remove(parameter.index)
            self._tries = 0
            if not self._asked:
                self._ask_missing(now_s)

    def expire(self, now_s: float) -> None:
        """Ask for what is missing, or give up."""
        if now_s >= self._ends_s:
            self._give_up(NoAnswerError, "not done in time")
        elif not self._count and self._tries < LIST_PATIENCE.tries:
            self._ask(now_s)
        elif not self._count:
            self._give_up(NoAnswerError, f"no answer, though asked {self._tries} times")
        elif not self._asked or self._tries < GAP_PATIENCE.tries:
            if not self._asked:
                self._tries = 0
            self._ask_missing(now_s)
        else:
            self._give_up(NoAnswerError, "the others do not come")

    def _ask(self, now_s: float) -> None:
        self._tries += 1
        system, component = self.target
        self.outbox.append(_LIST.make(target_system=system, target_component=component))
        self.deadline_s = min(now_s + LIST_PATIENCE.answer_s, self._ends_s)

    def _ask_missing(self, now_s: float) -> None:
        self._tries += 1
        missing = (index for index in range(self._count) if index not in self._had)
        self._asked = set(islice(missing, GAPS_AT_ONCE))
        for index in sorted(self._asked):
            self.outbox.append(read_request(self.target, b"", index))
        self.deadline_s = min(now_s + GAP_PATIENCE.answer_s, self._ends_s)

    def _give_up(self, error: type[ExchangeError], reason: str) -> None:
        had = f" ({len(self._had)} of {self._count} came)" if self._count else ""
        self.fail(error(f"reading the parameters: {reason}{had}"))
