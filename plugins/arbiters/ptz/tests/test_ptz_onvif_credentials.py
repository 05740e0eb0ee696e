"""Passwords come from a file that nobody else may read; fleets say the rest."""

import os

import pytest
from m2pem_plugin_ptz.drivers.onvif.settings import read_credentials, read_onvif

from m2pem.api import ResourceId
from m2pem.errors import PluginError

PTZ = ResourceId("evsg2/ptz")


@pytest.fixture
def store(tmp_path):
    def write(text, mode=0o600, name="my camera.yaml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        path.chmod(mode)
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "user: operator\npassword: 's: #1'\n",
        "# a comment\n{user: operator, password: 's: #1'}",
        "[camera]\nuser = operator\npassword = s: #1\n",
        "\n[camera]\nuser: operator\npassword: s: #1\n",
    ],
)
def test_user_and_password_are_read_from_yaml_and_ini(store, text):
    found = read_credentials(store(text))
    assert (found.user, found.password) == ("operator", "s: #1")
    assert "s: #1" not in repr(found)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o644, 0o660, 0o666, 0o601])
def test_a_file_that_others_may_read_is_refused_with_what_to_do(store, mode):
    path = store("user: a\npassword: b\n", mode)
    with pytest.raises(PluginError, match=r"others may read") as refused:
        read_credentials(path)
    assert f"chmod 600 '{path}'" in str(refused.value)
    assert f"{mode:04o}" in str(refused.value)


@pytest.mark.parametrize(
    "text",
    [
        "secret",
        "- user\n- secret",
        "user: operator",
        "user: operator\npassword: ''\n",
        "user: operator\npassword: {secret: 1}\n",
        "user: operator\npassword: yes\n  secret: [\n",
        "[one]\nuser=a\npassword=secret\n[two]\nuser=a\n",
        "[one\nsecret",
        b"\xff\xfesecret",
        "user: x\npassword: " + "secret" * 20000,
    ],
)
def test_what_is_no_account_is_refused_without_telling_what_is_in_it(store, text):
    with pytest.raises(PluginError, match=r"user: NAME and password: SECRET") as refused:
        read_credentials(store(text))
    assert "secret" not in str(refused.value)
    assert refused.value.__cause__ is None or "secret" not in str(refused.value.__cause__)


def test_what_is_no_file_is_refused_at_once(tmp_path):
    with pytest.raises(PluginError, match=r"gone\.yaml: cannot be read: No such file"):
        read_credentials(tmp_path / "gone.yaml")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe, 0o600)
    with pytest.raises(PluginError, match=r"this is not a file"):
        read_credentials(pipe)
    with pytest.raises(PluginError, match=r"this is not a file|cannot be read"):
        read_credentials(tmp_path)


def test_a_fleet_says_where_the_camera_is_and_the_rest_has_defaults():
    settings = read_onvif(PTZ, {"host": "::1", "url": "udpin://127.0.0.1:1", "namespace": "/x"})
    assert (settings.host, settings.port, settings.credentials) == ("::1", 80, None)
    assert settings.address == "[::1]:80"
    full = read_onvif(
        PTZ,
        {
            "host": "cam",
            "port": 8081,
            "credentials": "~/camera.yaml",
            "profile": "main",
            "timeout": "500 ms",
            "calls": 8,
            "invert": ["tilt"],
        },
    )
    assert (full.timeout_s, full.calls_s, full.inverted) == (0.5, 8.0, {"tilt"})
    assert "~" not in str(full.credentials)


@pytest.mark.parametrize(
    ("own", "text"),
    [
        ({}, r"evsg2/ptz: connection\.host: an ONVIF camera needs"),
        ({"host": "http://cam/"}, r"connection\.host"),
        ({"host": "cam", "port": 0}, r"connection\.port: 0 is not a whole number from 1 to 65535"),
        ({"host": "cam", "port": "80"}, r"connection\.port: '80' is not a whole number"),
        ({"host": "cam", "credential": "x"}, r"did you mean 'credentials'"),
        (
            {"host": "cam", "password": "secret"},
            r"connection\.password: many people read fleet files",
        ),
        ({"host": "cam", "timeout": "2 m"}, r"connection\.timeout: .*duration"),
        (
            {"host": "cam", "timeout": "2 min"},
            r"connection\.timeout: .* is not within 0.1",
        ),
        ({"host": "cam", "calls": 1000}, r"connection\.calls"),
        ({"host": "cam", "invert": "roll"}, r"connection\.invert: 'roll'"),
        ({"host": "cam", "profile": ""}, r"connection\.profile"),
    ],
)
def test_a_wrong_setting_is_refused_by_its_name(own, text):
    with pytest.raises(PluginError, match=text) as refused:
        read_onvif(PTZ, own)
    assert "secret" not in str(refused.value)
