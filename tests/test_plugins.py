"""Plugins are real here: distributions with entry points in a folder on the path."""

import asyncio
import inspect
import itertools
import logging
import re
import sys
import textwrap
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, cast

import click
import pytest

from m2pem import hookspecs
from m2pem.api.health import HealthStatus
from m2pem.api.runs import Alert, RunId
from m2pem.errors import InternalError, PluginError
from m2pem.executive.control_events import ControlEvents, LoggedAlerts, RecordObservers
from m2pem.findings import Finding, Severity
from m2pem.mission.mission import Mission
from m2pem.plugins import (
    DEFAULT_PLUGINS,
    PUBLISHED,
    PluginFailure,
    PluginInfo,
    PluginManager,
)
from m2pem.services.detector import Detector

MISSION = cast("Mission", type("FakeMission", (), {"file": "survey.bpmn"})())
DOCS = Path(__file__).parent.parent / "docs" / "plugins.md"

DICT: Any = dict
LIST: Any = list

Install = Callable[..., str]
_numbers = itertools.count()


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Installs a distribution with one plugin; answers with its module's name."""
    own = [str(tmp_path), *(path for path in sys.path if "site-packages" not in path)]
    monkeypatch.setattr(sys, "path", own)
    monkeypatch.delenv("M2PEM_BLOCK_PLUGINS", raising=False)

    def install(
        name: str, code: str, *, distribution: str = "", entry_points: str | None = None
    ) -> str:
        module = f"fake_plugin_{next(_numbers)}"  # a new one each time: modules stay imported
        distribution = distribution or f"m2pem-plugin-{name}"
        header = "from m2pem import hookimpl\n"
        (tmp_path / f"{module}.py").write_text(header + textwrap.dedent(code))
        info = tmp_path / f"{distribution.replace('-', '_')}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n"
        )
        text = entry_points if entry_points is not None else f"[m2pem]\n{name} = {module}\n"
        (info / "entry_points.txt").write_text(text.format(module=module))
        return module

    return install


def arbiter_code(name: str, factory: str = "dict") -> str:
    return f"""
        @hookimpl
        def m2pem_register_arbiters(register):
            register({name!r}, {factory})
    """


def manager(block: Collection[str] = ()) -> PluginManager:
    """Knows the installed plugins, and of the built-in ones the services."""
    return PluginManager(block, built_in=("m2pem.services.plugin",))


def only_failure(plugins: PluginManager) -> PluginFailure:
    (failure,) = plugins.failures
    return failure


# --- what works ---------------------------------------------------------------------------------


def test_built_ins_load_through_the_same_hooks() -> None:
    plugins = PluginManager(block=("all",))
    assert plugins.service("Detector") is Detector
    loaded = [info.name for info in plugins.listing() if not info.failure]
    assert loaded == list(DEFAULT_PLUGINS)
    assert plugins.failures == []


def test_installed_plugins_are_found_by_their_entry_points(install: Install) -> None:
    module = install(
        "boat",
        """
        import click
        from m2pem.findings import Finding, Severity

        @hookimpl
        def m2pem_register_arbiters(register):
            register("boat", dict)

        @hookimpl
        def m2pem_register_ocus(register):
            register(name="bridge", factory=list)

        @hookimpl
        def m2pem_register_services(register):
            register("Sounder", set)

        @hookimpl
        def m2pem_register_commands(cli):
            @cli.command()
            def dock():
                "Dock."

        @hookimpl
        def m2pem_check_mission(mission):
            return [Finding(Severity.WARNING, mission.file, 3, "", "tide", "low tide")]

        @hookimpl
        def m2pem_records_committed(run_id, records):
            records.append(run_id)
        """,
    )
    plugins = manager()
    cli = click.Group("m2pem")
    plugins.commands(cli)
    heard: list[Any] = []
    plugins.records_committed("r1", heard)
    assert plugins.arbiter("boat") is DICT
    assert plugins.ocu("bridge") is LIST
    assert dict(plugins.services()) == {"Detector": Detector, "Sounder": set}
    assert list(cli.commands) == ["dock"]
    assert plugins.check_mission(MISSION, None) == [
        Finding(Severity.WARNING, "survey.bpmn", 3, "", "tide", "low tide")
    ]
    assert heard == ["r1"]
    provides = (
        "arbiter boat",
        "ocu bridge",
        "service Sounder",
        "command dock",
        "mission checks",
        "record observer",
    )
    assert plugins.listing()[-1] == PluginInfo("boat", module, "m2pem-plugin-boat", "1.2", provides)
    assert plugins.failures == []


def test_an_entry_point_may_lead_to_an_object_with_hooks(install: Install) -> None:
    code = """
        class Plugin:
            @hookimpl
            def m2pem_register_arbiters(self, register):
                register("boat", dict)

        plugin = Plugin()
    """
    install("boat", code, entry_points="[m2pem]\nboat = {module}:plugin\n")
    assert manager().arbiter("boat") is DICT


def test_nothing_is_loaded_before_the_first_question(install: Install) -> None:
    module = install("boat", arbiter_code("boat"))
    plugins = manager()
    assert module not in sys.modules
    plugins.arbiters()
    assert module in sys.modules


def test_asking_for_arbiters_does_not_ask_for_ocus(install: Install) -> None:
    code = """
        @hookimpl
        def m2pem_register_ocus(register):
            raise AssertionError("not asked for")
    """
    install("boat", code + arbiter_code("boat"))
    plugins = manager()
    assert plugins.arbiter("boat") is DICT
    assert plugins.failures == []


def test_listing_leaves_the_command_line_alone_when_commands_were_added(install: Install) -> None:
    install(
        "boat",
        """
        @hookimpl
        def m2pem_register_commands(cli):
            cli.command("dock")(lambda: None)
        """,
    )
    plugins = manager()
    plugins.commands(click.Group())
    plugins.listing()
    assert plugins.listing()[-1].provides == ("command dock",)


# --- what breaks --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "error"),
    [
        ("import no_such_library", "ModuleNotFoundError: No module named 'no_such_library'"),
        ("raise SystemExit('cannot')", "SystemExit: cannot"),
        ("raise BaseException('cannot')", "BaseException: cannot"),
        ("1 +", "SyntaxError: invalid syntax"),
        ("x = 1", "nothing is marked with @m2pem.hookimpl in the module that"),
        (
            "def m2pem_register_ocus(register): pass",
            "m2pem_register_ocus is not marked with @m2pem.hookimpl",
        ),
        (
            "@hookimpl\ndef m2pem_register_arbiter(register): pass",
            "m2pem has no hook m2pem_register_arbiter;",
        ),
        (
            "@hookimpl\ndef m2pem_register_arbiters(registry): pass",
            "Argument(s) {'registry'} are declared in the hookimpl but can not be found",
        ),
        (
            "@hookimpl\nasync def m2pem_register_arbiters(register): pass",
            "m2pem_register_arbiters must be a plain function",
        ),
        (
            "@hookimpl(wrapper=True)\ndef m2pem_register_arbiters(register):\n    return (yield)",
            "m2pem_register_arbiters must be a plain function",
        ),
    ],
)
def test_a_plugin_that_cannot_be_loaded_is_reported_and_the_others_load(
    install: Install, code: str, error: str
) -> None:
    install("abad", code)
    install("zgood", arbiter_code("good"))
    plugins = manager()
    assert plugins.arbiter("good") is DICT
    failure = only_failure(plugins)
    assert (failure.name, failure.distribution) == ("abad", "m2pem-plugin-abad")
    assert (failure.version, failure.hook) == ("1.2", "")
    assert error in failure.error
    assert "\n" not in failure.error
    assert plugins.listing()[-1].failure == failure.error


@pytest.mark.parametrize(
    ("entry_points", "error"),
    [
        ("[m2pem]\nabad = {module}:missing\n", "AttributeError"),
        ("[m2pem]\nabad = not a module\n", "'not a module' is not `module` or `module:object`"),
        ("[m2pem]\nabad\n", "its entry points cannot be read"),
        (
            "[m2pem]\nabad = {module}:number\n",
            "nothing is marked with @m2pem.hookimpl in the int that",
        ),
    ],
)
def test_an_entry_point_that_makes_no_sense_is_reported(
    install: Install, entry_points: str, error: str
) -> None:
    install("abad", "number = 5", entry_points=entry_points)
    install("zgood", arbiter_code("good"))
    plugins = manager()
    assert plugins.arbiter("good") is DICT
    assert error in only_failure(plugins).error


def test_broken_entry_points_of_other_projects_are_none_of_our_business(install: Install) -> None:
    install("other", "", distribution="other", entry_points="[console_scripts]\nnonsense\n")
    install("good", arbiter_code("good"))
    plugins = manager()
    assert plugins.arbiter("good") is DICT
    assert plugins.failures == []


@pytest.mark.parametrize(
    ("registration", "error"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("register('bad', dict)", "arbiter 'bad' is registered by 'abad' already"),
        ("register('bad two', dict)", "'bad two' is no name for a plugin's arbiter"),
        ("register(5, dict)", "5 is no name for a plugin's arbiter"),
        ("register('worse', 'dict')", "arbiter 'worse': 'dict' cannot be called to make one"),
        ("register('worse')", "TypeError"),
    ],
)
def test_a_plugin_whose_hook_breaks_loses_what_the_hook_gave_and_nothing_else(
    install: Install, registration: str, error: str
) -> None:
    install(
        "abad",
        f"""
        @hookimpl
        def m2pem_register_arbiters(register):
            register("bad", dict)
            {registration}

        @hookimpl
        def m2pem_register_ocus(register):
            register("well", list)
        """,
    )
    install("zgood", arbiter_code("good"))
    plugins = manager()
    assert dict(plugins.arbiters()) == {"good": DICT}
    assert plugins.ocu("well") is LIST
    failure = only_failure(plugins)
    assert error in failure.error
    assert failure.hook == "m2pem_register_arbiters"


def test_the_first_of_two_plugins_keeps_a_name(install: Install) -> None:
    install("one", arbiter_code("boat", "dict"))
    install("two", arbiter_code("boat", "list"))
    plugins = manager()
    assert plugins.arbiter("boat") is DICT
    assert only_failure(plugins).name == "two"
    assert "arbiter 'boat' is registered by 'one' already" in only_failure(plugins).error


def test_a_plugin_cannot_replace_a_built_in(install: Install) -> None:
    install(
        "fake",
        """
        @hookimpl
        def m2pem_register_services(register):
            register("Detector", dict)
        """,
    )
    plugins = manager()
    assert plugins.service("Detector") is Detector
    assert "by 'm2pem.services.plugin' already" in only_failure(plugins).error


def test_of_two_plugins_of_one_name_the_second_is_reported(install: Install) -> None:
    install("boat", arbiter_code("one"), distribution="a-boat")
    install("boat", arbiter_code("two"), distribution="b-boat")
    plugins = manager()
    assert list(plugins.arbiters()) == ["one"]
    assert only_failure(plugins).distribution == "b-boat"
    assert "another plugin has the same name" in only_failure(plugins).error


@pytest.mark.parametrize(
    ("declaration", "problem"),
    [
        (
            "capabilities = ArbiterCapabilities(adjusts=True)",
            "adjusts=True, but it has no `adjust`",
        ),
        ("capabilities = {'adjusts'}", "not an m2pem.api.ArbiterCapabilities"),
        ("takes_one_vehicle = True", "`capabilities = ArbiterCapabilities(one_vehicle=...)`"),
        ("def reclaim(self, resource): ...", "it has `reclaim`, but its `capabilities` do not say"),
        (
            "capabilities = ArbiterCapabilities(reclaims=True)\n"
            "            reclaim = addresses = print",
            "it has `addresses`, but its `capabilities` do not say addresses=True",
        ),
    ],
)
def test_an_arbiter_that_declares_other_than_what_it_has_is_refused_with_its_plugin(
    install: Install, declaration: str, problem: str
) -> None:
    install(
        "boat",
        f"""
        from m2pem.api import ArbiterCapabilities

        class BoatArbiter:
            {declaration}

        @hookimpl
        def m2pem_register_arbiters(register):
            register("boat", BoatArbiter)
        """,
    )
    plugins = manager()
    with pytest.raises(PluginError, match=r"plugin 'boat' \(m2pem-plugin-boat 1\.2\)"):
        plugins.arbiter("boat")
    assert problem in only_failure(plugins).error


@pytest.mark.parametrize(
    ("declaration", "problem"),
    [
        ("takes_terminal = True", "`capabilities = OcuCapabilities(takes_terminal=...)`"),
        ("imports = ('wave',)", "`capabilities = OcuCapabilities(imports=...)`"),
        ("capabilities = True", "not an m2pem.api.OcuCapabilities"),
    ],
)
def test_an_operator_unit_that_declares_nothing_that_counts_is_refused_with_its_plugin(
    install: Install, declaration: str, problem: str
) -> None:
    install(
        "bridge",
        f"""
        class BridgeOcu:
            {declaration}

        @hookimpl
        def m2pem_register_ocus(register):
            register("bridge", BridgeOcu)
        """,
    )
    plugins = manager()
    with pytest.raises(PluginError, match="plugin 'bridge'"):
        plugins.ocu("bridge")
    assert problem in only_failure(plugins).error


def test_a_command_that_would_replace_another_is_refused_with_its_plugin(install: Install) -> None:
    install(
        "boat",
        """
        @hookimpl
        def m2pem_register_commands(cli):
            cli.command("dock")(lambda: None)
            cli.command("run")(lambda: None)
        """,
    )
    cli = click.Group()
    run = cli.command("run")(lambda: None)
    plugins = manager()
    plugins.commands(cli)
    assert cli.commands == {"run": run}
    assert only_failure(plugins).error == "there is a command run already"


SIMULATOR = """
        import click
        @hookimpl
        def m2pem_register_commands(cli):
            group = click.Group("sim")
            group.command("{0}")(lambda: None)
            cli.add_command(group)
        """


def test_plugins_share_a_group_of_commands(install: Install) -> None:
    install("boat", SIMULATOR.format("sea"))
    install("truck", SIMULATOR.format("road"))
    cli = click.Group()
    plugins = manager()
    plugins.commands(cli)
    group = cli.commands["sim"]
    assert isinstance(group, click.Group)
    assert sorted(group.commands) == ["road", "sea"]
    assert not plugins.failures


def test_a_command_that_would_replace_another_of_a_shared_group_is_refused(
    install: Install,
) -> None:
    install("a-boat", SIMULATOR.format("sea"))
    install("b-boat", SIMULATOR.format("sea"))
    cli = click.Group()
    plugins = manager()
    plugins.commands(cli)
    assert only_failure(plugins).error == "there is a command sim sea already"
    assert only_failure(plugins).distribution == "m2pem-plugin-b-boat"


def test_a_plugin_whose_commands_break_adds_none(install: Install) -> None:
    install(
        "boat",
        """
        @hookimpl
        def m2pem_register_commands(cli):
            cli.command("dock")(lambda: None)
            raise OSError("no harbour")
        """,
    )
    cli = click.Group()
    plugins = manager()
    plugins.commands(cli)
    assert cli.commands == {}
    assert str(plugins.unknown("command", "dock")) == (
        "command 'dock' is not available: plugin 'boat' (m2pem-plugin-boat 1.2): "
        "OSError: no harbour"
    )


@pytest.mark.parametrize("body", ["1 / 0", "return 5", "return ['bad']", "raise SystemExit(3)"])
def test_a_check_that_breaks_is_a_warning(install: Install, body: str) -> None:
    install("boat", f"@hookimpl\ndef m2pem_check_mission(mission, fleet):\n    {body}")
    plugins = manager()
    (finding,) = plugins.check_mission(MISSION, None)
    assert (finding.severity, finding.file) == (Severity.WARNING, "survey.bpmn")
    assert finding.rule == "plugin-check-broken"
    assert "plugin 'boat' (m2pem-plugin-boat 1.2)" in finding.message
    assert only_failure(plugins).hook == "m2pem_check_mission"


def test_a_check_may_return_nothing(install: Install) -> None:
    install("boat", "@hookimpl\ndef m2pem_check_mission(): pass")
    assert manager().check_mission(MISSION, None) == []


def test_a_check_of_the_host_that_exits_is_a_warning(install: Install) -> None:
    install("boat", "@hookimpl\ndef m2pem_check_host(fleet):\n    raise SystemExit(3)")
    plugins = manager()
    (check,) = plugins.check_host(None)
    assert (check.status, "SystemExit: 3" in check.message) == (HealthStatus.WARNING, True)


def test_ctrl_c_while_a_plugin_is_asked_ends_the_program(install: Install) -> None:
    install("boat", "@hookimpl\ndef m2pem_check_mission():\n    raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        manager().check_mission(MISSION, None)


@pytest.mark.parametrize("error", ["1 / 0", "raise SystemExit", "raise CancelledError"])
async def test_of_an_observer_that_breaks_operators_get_one_alert_and_the_others_go_on(
    install: Install, error: str
) -> None:
    code = "from asyncio import CancelledError\n@hookimpl\ndef m2pem_records_committed(run_id):"
    install("abad", f"{code}\n    {error}")
    observe = "def m2pem_records_committed(run_id, records):\n    records.append(run_id)"
    install("zgood", f"@hookimpl\n{observe}")
    events, heard = ControlEvents(), list[str]()
    observers = RecordObservers(manager().records_committed, events)
    alerts = events.subscribe(None, 10)
    with LoggedAlerts(events):
        observers.start()
        for run in ("r7", "r8", "r9"):
            observers.put(RunId(run), cast("Any", heard))
        async with asyncio.timeout(20):
            await observers.close()
    events.end()
    assert heard == ["r7", "r8", "r9"]
    (alert,) = [each async for each in alerts]
    assert isinstance(alert, Alert)
    assert "run r7: the observer of plugin 'abad'" in alert.text


def test_an_observer_that_breaks_is_logged_and_the_others_still_hear(
    install: Install, caplog: pytest.LogCaptureFixture
) -> None:
    install("abad", "@hookimpl\ndef m2pem_records_committed(run_id):\n    1 / 0")
    install(
        "zgood",
        "@hookimpl\ndef m2pem_records_committed(run_id, records):\n    records.append(run_id)",
    )
    plugins = manager()
    heard: list[Any] = []
    with caplog.at_level(logging.ERROR):
        plugins.records_committed("r7", heard)
        plugins.records_committed("r8", heard)
    assert heard == ["r7", "r8"]
    assert "run r7: the observer of plugin 'abad'" in caplog.text
    assert "ZeroDivisionError" in caplog.text
    assert only_failure(plugins).hook == "m2pem_records_committed"


@pytest.mark.parametrize("code", [None, "import no_such_library", "x = 1"])
def test_a_built_in_that_is_missing_or_broken_is_a_bug_of_m2pem(
    install: Install, code: str | None
) -> None:
    module = install("x", code, entry_points="") if code else "m2pem.no_such_plugin"
    with pytest.raises(InternalError, match=f"built-in plugin '{module}'"):
        PluginManager(built_in=(module,)).arbiters()


def test_a_built_in_whose_hook_breaks_is_a_bug_of_m2pem(install: Install) -> None:
    module = install("x", arbiter_code("sim", "5"), entry_points="")
    with pytest.raises(InternalError, match="arbiter 'sim': 5 cannot be called"):
        PluginManager(built_in=(module,)).arbiters()


# --- names that nobody offers -------------------------------------------------------------------


def test_an_unknown_arbiter_is_an_error_that_says_what_there_is_and_where_to_get_it(
    install: Install,
) -> None:
    install("boat", arbiter_code("boat"))
    install("car", arbiter_code("car"))
    with pytest.raises(PluginError) as raised:
        manager().arbiter("mavlink")
    assert str(raised.value) == (
        "there is no arbiter 'mavlink'; known: boat, car; "
        "'mavlink' is in a plugin: pip install 'm2pem-plugin-mavlink' "
        "(docs/install.md says from where)"
    )


def test_a_name_nearly_right_is_suggested(install: Install) -> None:
    with pytest.raises(PluginError, match="did you mean 'Detector'"):
        manager().service("Detecter")


def test_what_only_a_broken_plugin_could_provide_is_blamed_on_it(install: Install) -> None:
    install("ros", "import no_such_library")
    install("car", "1 / 0")
    with pytest.raises(PluginError) as raised:
        manager().arbiter("ros")
    assert str(raised.value) == (
        "arbiter 'ros' is not available: plugin 'ros' (m2pem-plugin-ros 1.2): "
        "ModuleNotFoundError: No module named 'no_such_library'"
    )


def test_what_a_broken_hook_had_registered_is_blamed_on_its_plugin(install: Install) -> None:
    code = """
        @hookimpl
        def m2pem_register_ocus(register):
            register("bridge", list)
            raise OSError("no display")
    """
    install("boat", code)
    with pytest.raises(PluginError, match=r"ocu 'bridge' is not available.*OSError: no display"):
        manager().ocu("bridge")


def test_an_unknown_name_names_the_broken_plugins_that_may_have_had_it(install: Install) -> None:
    install("fleet", "import no_such_library")
    with pytest.raises(PluginError, match=r"no arbiter 'rover'.*not loaded: plugin 'fleet'"):
        manager().arbiter("rover")


# --- blocking -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["boat", "m2pem-plugin-boat", "M2PEM_Plugin.boat", "all"])
def test_a_blocked_plugin_is_not_even_imported(install: Install, name: str) -> None:
    module = install("boat", arbiter_code("boat"))
    plugins = manager(block=[name])
    with pytest.raises(PluginError, match=r"arbiter 'boat' is not available.*blocked"):
        plugins.arbiter("boat")
    assert module not in sys.modules
    assert plugins.service("Detector") is Detector
    assert plugins.failures == []
    assert "blocked" in plugins.listing()[-1].failure


def test_the_environment_blocks_plugins_too(
    install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("boat", "car", "ship"):
        install(name, arbiter_code(name))
    monkeypatch.setenv("M2PEM_BLOCK_PLUGINS", "boat, ship")
    assert list(manager().arbiters()) == ["car"]


# --- documentation ------------------------------------------------------------------------------


def test_every_hook_is_documented_with_its_arguments() -> None:
    text = DOCS.read_text()
    hooks = {
        name: function
        for name, function in vars(hookspecs).items()
        if name.startswith("m2pem_") and inspect.isfunction(function)
    }
    assert hooks
    missing = [
        signature
        for name, function in hooks.items()
        if (signature := f"{name}({', '.join(inspect.signature(function).parameters)})") not in text
    ]
    assert missing == [], "hooks that docs/plugins.md does not describe"
    described = set(re.findall(r"\bm2pem_[a-z]+_[a-z]+(?=\()", text))
    assert described <= set(hooks), "docs/plugins.md describes hooks that do not exist"


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("arbiter mavlnk", "'mavlink' is in a plugin: pip install 'm2pem-plugin-mavlink' ("),
        ("ocu termnal", "'terminal' is in a plugin: pip install 'm2pem-plugin-terminal' ("),
        ("arbiter boat", "is the plugin that has it installed?"),
        ("arbiter termnal", "is the plugin that has it installed?"),
        ("ocu mavlnk", "is the plugin that has it installed?"),
    ],
)
def test_a_plugin_that_does_not_exist_is_not_recommended(name: str, hint: str) -> None:
    kind, name = name.split()
    error = str(PluginManager(block=("all",)).unknown(kind, name))
    assert hint in error
    assert f"m2pem-plugin-{name}" not in error


def test_the_plugins_that_are_recommended_are_those_of_the_repository() -> None:
    folders = DOCS.parent.parent / "plugins"
    every = {path.parent.name for path in folders.glob("*/*/pyproject.toml")}
    for kind, folder in (("arbiter", "arbiters"), ("ocu", "ocu"), ("face", "faces")):
        there = {path.parent.name for path in (folders / folder).glob("*/pyproject.toml")}
        assert there <= set(PUBLISHED[kind].values()) <= every
        for name in there:
            project = (folders / folder / name / "pyproject.toml").read_text(encoding="utf-8")
            assert f'name = "m2pem-plugin-{name}"' in project
