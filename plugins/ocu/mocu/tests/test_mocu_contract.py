"""The contract of operator control units, with an operator in another process, over DDS."""

import itertools
import json

import pytest
from m2pem_plugin_mocu.ocu import MocuOcu
from m2pem_plugin_mocu.settings import NAMESPACE
from mocu_world import ONE, OTHER, Client

from m2pem.api import MissionControl, OpenPrompt, RunId
from m2pem.testing import OcuContract
from m2pem.testing.contracts.ocu import MakeOcu, Operate

STOP = 1


class Seat:
    """Who sits at the client, and steers the unit of a namespace."""

    def __init__(self, client: Client, namespace: str) -> None:
        self._client = client
        self._namespace = namespace

    def screen(self) -> str:
        """All lines that the client has printed of this unit."""
        return "\n".join(
            json.dumps(each, ensure_ascii=False)
            for each in list(self._client.said)
            if each.get("namespace") in (self._namespace, None)
        )

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        fields = {"run": prompt.run, "prompt": prompt.prompt, "decision": decision}
        self._client.send("answer_prompt", self._namespace, by="anna@mocu1", **fields)

    async def stop(self, run: RunId) -> None:
        self._client.send("control_run", self._namespace, verb=STOP, run=run)


class TestMocu(OcuContract):
    @pytest.fixture
    def make_ocu(self, client: Client) -> MakeOcu:
        places = itertools.cycle([ONE, OTHER])

        def make(control: MissionControl) -> MocuOcu:
            return MocuOcu(control, environment={NAMESPACE: next(places)}, domain_id=client.domain)

        return make

    @pytest.fixture
    def operate(self, client: Client) -> Operate:
        def operate(ocu: MocuOcu) -> Seat:
            return Seat(client, ocu.namespace)

        return operate
