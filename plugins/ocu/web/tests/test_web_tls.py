"""TLS and named users: what another address than this machine's own demands."""

import shutil
import ssl
import subprocess
from pathlib import Path

import pytest
import websockets
from m2pem_plugin_web.access.roles import Role
from web_world import PASSWORD, Browser, MakeWorld

from m2pem.errors import PluginError

pytestmark = pytest.mark.skipif(not shutil.which("openssl"), reason="openssl makes certificates")


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("tls")
    paths = folder / "cert.pem", folder / "key.pem"
    words = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]
    words += ["-nodes", "-days", "1", "-subj", "/CN=gcs1", "-addext"]
    words += ["subjectAltName=IP:127.0.0.1", "-out", str(paths[0]), "-keyout", str(paths[1])]
    subprocess.run(words, check=True, capture_output=True)
    return paths


def settings(certificate: tuple[Path, Path]) -> dict[str, str]:
    return {"M2PEM_WEB_CERT": str(certificate[0]), "M2PEM_WEB_KEY": str(certificate[1])}


async def test_with_tls_the_page_is_served_as_ever(
    world: MakeWorld, certificate: tuple[Path, Path]
) -> None:
    trusted = ssl.create_default_context(cafile=str(certificate[0]))
    async with world(users={"otto": Role.OPERATOR}, **settings(certificate)) as here:
        assert here.base.startswith("https://")
        browser = Browser(here.base, verify=trusted)
        here.browsers.append(browser)
        body = {"name": "otto", "password": PASSWORD}
        answer = await browser.http.post("/api/session", json=body)
        assert answer.status_code == 200
        assert "; secure" in answer.headers["set-cookie"].lower()
        browser.key = answer.json()["key"]
        assert (await browser.http.post("/api/stop", json={})).status_code == 200
        plain = here.base.replace("https", "http")
        refused = await browser.http.post("/api/stop", json={}, headers={"Origin": plain})
        assert refused.status_code == 403
        assert (await (await browser.live(ssl=trusted)).watch(None))["run"] is None
        with pytest.raises(websockets.InvalidStatus):
            await browser.live(ssl=trusted, origin=plain)


async def test_a_certificate_that_is_none_is_refused(world: MakeWorld, tmp_path: Path) -> None:
    files = tmp_path / "cert.pem", tmp_path / "key.pem"
    for file in files:
        file.write_text("nothing")
    with pytest.raises(PluginError, match="not a certificate with its key"):
        async with world(users={"otto": Role.OPERATOR}, **settings(files)):
            pass
