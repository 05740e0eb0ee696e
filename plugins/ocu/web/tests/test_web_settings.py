"""What the environment may say, and what is unsafe."""

from pathlib import Path

import pytest
from m2pem_plugin_web.settings import LOCAL_NAMES, SettingError, Settings, read_settings


def test_the_page_serves_this_machine_alone_unless_told_otherwise() -> None:
    settings = read_settings({})
    assert settings == Settings()
    assert settings.host == "127.0.0.1"
    assert settings.names == LOCAL_NAMES
    assert settings.address(8700) == "http://127.0.0.1:8700/"


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "[::1]", "127.0.0.2"])
def test_an_address_of_this_machine_alone_needs_nothing(host: str) -> None:
    assert read_settings({"M2PEM_WEB_HOST": host}).host == host.strip("[]")


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "10.0.0.5", "gcs1.example.org"])
def test_another_address_demands_tls_and_users(host: str) -> None:
    with pytest.raises(SettingError, match=r"TLS .* and named users"):
        read_settings({"M2PEM_WEB_HOST": host})


@pytest.fixture
def tls(tmp_path: Path) -> dict[str, str]:
    files = {"M2PEM_WEB_CERT": "cert.pem", "M2PEM_WEB_KEY": "key.pem"}
    for name in files.values():
        (tmp_path / name).touch()
    return {variable: str(tmp_path / name) for variable, name in files.items()}


def test_tls_alone_or_users_alone_are_not_enough(tls: dict[str, str]) -> None:
    host = {"M2PEM_WEB_HOST": "10.0.0.5"}
    with pytest.raises(SettingError, match="requires named users"):
        read_settings({**host, **tls})
    with pytest.raises(SettingError, match="requires TLS"):
        read_settings({**host, "M2PEM_WEB_USERS": "users.json"})


def test_with_both_another_address_is_served(tls: dict[str, str]) -> None:
    settings = read_settings({"M2PEM_WEB_HOST": "10.0.0.5", "M2PEM_WEB_USERS": "u.json", **tls})
    assert settings.names == {"10.0.0.5"}
    assert settings.address(8700) == "https://10.0.0.5:8700/"


def test_every_address_needs_a_name(tls: dict[str, str]) -> None:
    everywhere = {"M2PEM_WEB_HOST": "0.0.0.0", "M2PEM_WEB_USERS": "u.json", **tls}
    with pytest.raises(SettingError, match="M2PEM_WEB_NAMES"):
        read_settings(everywhere)
    settings = read_settings({**everywhere, "M2PEM_WEB_NAMES": "GCS1.example.org, 10.0.0.5"})
    assert settings.names == {*LOCAL_NAMES, "gcs1.example.org", "10.0.0.5"}
    assert settings.address(1) == "https://gcs1.example.org:1/"


@pytest.mark.parametrize("port", ["x", "-1", "65536", "8_700", "٣"])
def test_a_port_is_a_number(port: str) -> None:
    with pytest.raises(SettingError, match="is not a port"):
        read_settings({"M2PEM_WEB_PORT": port})


def test_a_certificate_and_its_key_go_together(tls: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="go together"):
        read_settings({"M2PEM_WEB_CERT": tls["M2PEM_WEB_CERT"]})
    with pytest.raises(SettingError, match="the file does not exist"):
        read_settings({**tls, "M2PEM_WEB_KEY": str(tmp_path / "none")})
