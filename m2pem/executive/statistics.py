"""The statistics of an executive, for `MissionControl.statistics`: what was counted up to now, and
what there is, which is looked up when it is asked for.
"""

from collections.abc import Callable
from dataclasses import dataclass

from m2pem.api.clock import Clock
from m2pem.api.statistics import ExecutiveStatistics, LinkStatistics
from m2pem.engine.state import RunStatus
from m2pem.executive.control_events import RecordObservers
from m2pem.executive.supervisor import Supervisor
from m2pem.mission.catalogue import ResourceId
from m2pem.telemetry.bus import Bus
from m2pem.telemetry.link_monitor import LinkMonitor
from m2pem.units import US_PER_S


@dataclass(eq=False)
class StatisticsReader:
    """Reads the statistics off the parts of an executive.

    `links`: returns what watches the links; None: they are not watched.
    """

    _supervisor: Supervisor
    _bus: Bus
    _observers: RecordObservers | None
    _clock: Clock
    _links: Callable[[], LinkMonitor | None]

    def read(self) -> ExecutiveStatistics:
        """What was counted up to now, and what there is."""
        supervisor, observers = self._supervisor, self._observers
        runners = supervisor.runners.values()
        going_on = [each for each in runners if not each.done.is_set()]
        states = [each.run.state for each in going_on]
        statuses = (RunStatus.RUNNING, RunStatus.PAUSED)
        counts = supervisor.counts
        monitor = self._links()
        return ExecutiveStatistics(
            inputs=counts.inputs,
            records=counts.records,
            commits=counts.commits.counts(),
            loop=supervisor.stalls.lateness.counts(),
            runs={each.value: sum(one.status is each for one in states) for each in statuses},
            runs_ended=dict(counts.ended),
            inboxes={each.id: each.waiting for each in going_on},
            behaviors=supervisor.dispatcher.under_way,
            prompts=sum(len(each.prompts) for each in going_on),
            incidents=sum(len(each.incidents) for each in states),
            calls_waiting=supervisor.dispatcher.calls_waiting,
            events_waiting=supervisor.events.waiting,
            events_cut_off=supervisor.events.cut_off,
            observers_waiting=0 if observers is None else observers.waiting,
            observations_dropped=0 if observers is None else observers.dropped,
            telemetry_dropped=self._bus.dropped,
            subscriptions=self._bus.readers(),
            links={each: self._link(each, monitor) for each in supervisor.arbiters.resources},
        )

    def _link(self, resource: ResourceId, monitor: LinkMonitor | None) -> LinkStatistics:
        state = self._bus.latest(resource)
        if state is None:
            return LinkStatistics(None)
        received_us = None if monitor is None else monitor.received_us(resource)
        at_us = state.time_us if received_us is None else received_us
        age_us = max(0, self._clock.now_us() - at_us)
        return LinkStatistics(state.link, age_us / US_PER_S)
