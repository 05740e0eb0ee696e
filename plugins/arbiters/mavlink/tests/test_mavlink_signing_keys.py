"""Key files, and what a fleet file says about signing."""

import base64
import logging
import os
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.settings import read_settings
from m2pem_plugin_mavlink.signing.key_file import SigningError, read_key, write_new_key

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.errors import PluginError

KEY = bytes(range(100, 132))
V1 = ResourceId("v1")


def key_file(folder: Path, content: bytes, mode: int = 0o600) -> Path:
    path = folder / "v1.key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


@pytest.mark.parametrize(
    ("content", "key"),
    [
        pytest.param(b"\xff" + KEY[1:], b"\xff" + KEY[1:], id="raw"),
        pytest.param(KEY.hex().encode() + b"\n", KEY, id="hex"),
        pytest.param(base64.b64encode(KEY), KEY, id="base64"),
        pytest.param(b"correct horse battery\n", sha256(b"correct horse battery").digest(), id="a"),
        pytest.param(b"p" * 32, sha256(b"p" * 32).digest(), id="a passphrase of 32 characters"),
    ],
)
def test_a_key_is_bytes_hex_base64_or_a_passphrase(
    tmp_path: Path, content: bytes, key: bytes
) -> None:
    assert read_key(key_file(tmp_path, content)) == key


@pytest.mark.parametrize(
    ("content", "mode", "problem"),
    [
        (KEY.hex().encode(), 0o640, r"others may read or change .*v1.key \(mode 0640\): chmod 600"),
        (KEY.hex().encode(), 0o602, "chmod 600"),
        (b"", 0o600, "16 characters or more"),
        (b"tooshort", 0o600, "16 characters or more"),
        (b"\xff\x00", 0o600, "write 32 bytes"),
        (b"x" * 5000, 0o600, "write 32 bytes"),
        (bytes(32), 0o600, "zeros"),
        (b"0" * 64, 0o600, "zeros turns signing off"),
    ],
)
def test_other_files_are_refused_by_name_and_without_their_content(
    tmp_path: Path, content: bytes, mode: int, problem: str
) -> None:
    path = key_file(tmp_path, content, mode)
    with pytest.raises(SigningError, match=problem) as refused:
        read_key(path)
    assert str(path) in str(refused.value)
    assert not content or content.decode("latin-1") not in str(refused.value)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SigningError, match="cannot be read: No such file"):
        read_key(tmp_path / "none")
    os.mkfifo(tmp_path / "pipe", 0o600)
    with pytest.raises(SigningError, match="is not a file"):
        read_key(tmp_path / "pipe")


def test_a_new_key_is_for_its_owner_alone_and_replaces_none(tmp_path: Path) -> None:
    first, second = tmp_path / "1.key", tmp_path / "2.key"
    write_new_key(first)
    write_new_key(second)
    assert first.stat().st_mode & 0o777 == 0o600
    assert read_key(first) == sha256(first.read_text().strip().encode()).digest()
    assert read_key(first) != read_key(second)
    with pytest.raises(SigningError, match="exists"):
        write_new_key(first)


def settings(**more: Any) -> Any:
    values = {"url": "udpin://127.0.0.1:14550", "system_id": 1, **more}
    return read_settings({V1: Connection(V1, "air", values)})[V1]


def test_a_vehicle_without_the_setting_is_not_signed() -> None:
    assert settings().signing is None


def test_the_settings_of_signing_are_read() -> None:
    read = settings(signing={"key": "~/v1.key", "link_id": 7, "accept_unsigned": ["AHRS", 154]})
    assert read.signing.key == Path("~/v1.key").expanduser()
    assert (read.signing.link_id, read.signing.accept_unsigned) == (7, ("AHRS", 154))


@pytest.mark.parametrize(
    ("signing", "problem"),
    [
        ({}, r"v1: connection\.signing\.key: it is missing"),
        ("secret", r"v1: connection\.signing: 'secret' is not a map"),
        ({"key": "v1.key"}, r"connection\.signing\.key: v1.key is relative"),
        ({"key": "/k", "link": 1}, "there is no such setting; did you mean 'link_id'"),
        ({"key": "/k", "link_id": 256}, "link_id: 256 is not a whole number from 0 to 255"),
        ({"key": "/k", "accept_unsigned": "AHRS"}, "accept_unsigned: a list of names"),
        ({"key": "/k", "accept_unsigned": [0]}, "accept_unsigned: a list of names"),
        ({"key": "/k", "accept_unsigned": [1]}, "component 1 is the autopilot"),
    ],
)
def test_what_is_wrong_with_them_is_said(signing: Any, problem: str) -> None:
    with pytest.raises(PluginError, match=problem):
        settings(signing=signing)


def test_mavsdk_cannot_sign() -> None:
    with pytest.raises(PluginError, match=r"connection\.signing: MAVSDK has no interface"):
        settings(driver="mavsdk", signing={"key": "/k"})


@pytest.mark.parametrize(
    ("signing", "problem"),
    [
        ({"key": "/nowhere/v1.key"}, r"v1: connection\.signing: /nowhere/v1\.key cannot be read"),
        ({"accept_unsigned": ["NONE"]}, "accept_unsigned: there is no message NONE"),
    ],
)
async def test_an_arbiter_does_not_connect_without_the_key(
    tmp_path: Path, signing: dict[str, Any], problem: str
) -> None:
    values = {
        "url": "udpin://127.0.0.1:0",
        "system_id": 1,
        "signing": {"key": str(key_file(tmp_path, KEY.hex().encode())), **signing},
    }
    context = ArbiterContext(None, None, logging.getLogger(), (0.0, 0.0, 0.0))  # type: ignore[arg-type]
    arbiter = MavlinkArbiter({V1: Connection(V1, "air", values)}, context)
    with pytest.raises(PluginError, match=problem):
        await arbiter.connect()
    await arbiter.close()
