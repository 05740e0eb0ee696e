"""The package mavsdk: whether it is there, and where its log goes."""

import asyncio
import logging
import sys
from importlib import metadata
from types import SimpleNamespace

import pytest
from m2pem_plugin_mavlink.mavsdk_driver import library

from m2pem.errors import PluginError


def test_without_the_package_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mavsdk.asyncio", None)
    monkeypatch.setattr(library, "version", _no_version)
    with pytest.raises(PluginError, match=r"pip install 'm2pem-plugin-mavlink\[mavsdk\]'"):
        library.require()


def test_an_old_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mavsdk.asyncio", None)
    monkeypatch.setattr(library, "version", lambda _: "3.15.3")
    with pytest.raises(PluginError, match=r"version 3\.15\.3 is installed"):
        library.require()


def _no_version(name):
    raise metadata.PackageNotFoundError(name)


def test_a_package_that_does_not_load_is_no_riddle(monkeypatch):
    def broken(_):
        raise OSError("libcmavsdk.so: wrong ELF class")

    monkeypatch.setattr(library.importlib, "import_module", broken)
    with pytest.raises(PluginError, match=r"does not load here: libcmavsdk\.so: wrong ELF class"):
        library.require()


def test_an_import_error_of_something_else_is_not_blamed_on_it(monkeypatch):
    def broken(_):
        raise ModuleNotFoundError("No module named 'numpy'", name="numpy")

    monkeypatch.setattr(library.importlib, "import_module", broken)
    with pytest.raises(ModuleNotFoundError, match="numpy"):
        library.require()


async def test_its_log_is_handed_to_the_loop_at_the_right_level(caplog, monkeypatch):
    caplog.set_level(logging.DEBUG, library.__name__)
    log, subscribed = library.require("mavsdk.logging"), []
    native = SimpleNamespace(mavsdk_log_subscribe=lambda call, _: subscribed.append(call))
    known = SimpleNamespace(LogCallback=log.LogCallback, _cmavsdk_lib=native)
    with monkeypatch.context() as patched:
        patched.setattr(library.importlib, "import_module", lambda _: known)
        library.read_log()
    (say,) = subscribed
    try:
        assert await asyncio.to_thread(say, 2, b"a warning", None, 0, None)
        assert await asyncio.to_thread(say, 1, b"an \xff info", None, 0, None)
    finally:
        library.leave_log()
    say(3, b"no loop reads this", None, 0, None)
    await asyncio.sleep(0)
    assert [(each.levelname, each.message) for each in caplog.records] == [
        ("WARNING", "MAVSDK: a warning"),
        ("DEBUG", "MAVSDK: an \ufffd info"),
    ]
    assert {each.threadName for each in caplog.records} == {"MainThread"}
