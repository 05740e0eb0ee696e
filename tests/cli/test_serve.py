"""Which interrupted runs `m2pem serve` takes up: those of the fleet that it serves."""

from dataclasses import replace

import pytest

from m2pem.cli.serve import interrupted_runs
from m2pem.fleet.fleet import Domain, Fleet, Vehicle, dump, simulated_fleet
from m2pem.journal import MemoryJournal
from m2pem.journal.base import RunHeader
from m2pem.journal.mission import fleet_of
from m2pem.mission.catalogue import ResourceId

UGV1 = ResourceId("ugv1")
FLEET = Fleet("f", "f.yaml", {UGV1: Vehicle(UGV1, Domain.GROUND, "ros", {"port": 1})})
REAL = RunHeader("m.bpmn", b"", "P", dump(FLEET))
SIMULATED = RunHeader("m.bpmn", b"", "P", dump(simulated_fleet(FLEET)), simulated=True)
SIMULATED_BY_0_1_0 = replace(SIMULATED, fleet=dump(FLEET))


@pytest.mark.parametrize("header", [SIMULATED, SIMULATED_BY_0_1_0])
def test_the_fleet_of_a_simulated_run_is_simulated(header: RunHeader) -> None:
    assert fleet_of(header).simulated
    assert fleet_of(header).vehicles[UGV1].settings == {"port": 1}


@pytest.mark.parametrize(
    ("header", "simulate", "taken_up"),
    [
        (REAL, False, True),
        (REAL, True, False),
        (SIMULATED, True, True),
        (SIMULATED_BY_0_1_0, True, True),
        (SIMULATED_BY_0_1_0, False, False),
        (replace(REAL, speed=2.0), False, False),
        (replace(REAL, fleet=b"of another release"), False, False),
    ],
)
async def test_runs_of_the_fleet_that_is_served_are_taken_up(
    header: RunHeader, simulate: bool, taken_up: bool
) -> None:
    journal = MemoryJournal()
    run = await journal.create(header)
    await journal.release(run)
    served = simulated_fleet(FLEET) if simulate else FLEET
    mine, others = await interrupted_runs(journal, served, 1.0)
    assert ([line.run for line in mine], [line.run for line in others]) == (
        ([run], []) if taken_up else ([], [run])
    )
