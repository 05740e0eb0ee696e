"""Files that are sent to do harm: entities, bombs, and what is no XML at all."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from web_world import MakeWorld, World

from m2pem.testing import scenarios

SECRET = "nobody may read this"
ROUTES = (
    ("POST", "/api/checks", {}),
    ("POST", "/api/editable", {}),
    ("PUT", "/api/missions/new", {"base": None}),
)
ORDERS = (
    ("POST", "/api/rehearsals", {}),
    ("POST", "/api/verifications", {}),
)
"""In processes of their own, which take a while to start."""
QUICK_S = 20.0
"""Of a process that is started for it, on a machine with other work; a bomb would take hours."""

Attack = Callable[[Path], str]


def process(text: str) -> str:
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">'
        f'<process id="P" name="{text}" isExecutable="true"><documentation>{text}</documentation>'
        '<startEvent id="S"/></process></definitions>'
    )


def xxe(path: Path) -> str:
    return f'<!DOCTYPE x [<!ENTITY e SYSTEM "{path.as_uri()}">]>{process("&e;")}'


def parameter_entity(path: Path) -> str:
    return f'<!DOCTYPE x [<!ENTITY % e SYSTEM "{path.as_uri()}"> %e;]>{process("x")}'


def external_dtd(path: Path) -> str:
    return f'<!DOCTYPE x SYSTEM "{path.as_uri()}">{process("x")}'


def xinclude(path: Path) -> str:
    include = f'<i:include xmlns:i="http://www.w3.org/2001/XInclude" href="{path}" parse="text"/>'
    return process("x").replace("</documentation>", f"{include}</documentation>")


def billion_laughs(_: Path) -> str:
    lines = ['<!ENTITY l0 "lol">']
    lines += [f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10)]
    return f"<!DOCTYPE x [{''.join(lines)}]>{process('&l9;')}"


def quadratic(_: Path) -> str:
    return f'<!DOCTYPE x [<!ENTITY e "{"x" * 100_000}">]>{process("&e;" * 10_000)}'


def deep(_: Path) -> str:
    return process("x").replace("x</doc", f"{'<a>' * 100_000}{'</a>' * 100_000}</doc")


def endless(_: Path) -> str:
    return "<a " * 1_000_000


def nothing(_: Path) -> str:
    return ""


async def sent(here: World, method: str, path: str, xml: str, more: dict[str, object]) -> str:
    """Send a file; what came of it, when whatever was ordered has ended."""
    browser = here.browsers[0] if here.browsers else await here.browser()
    answer = await browser.http.request(method, path, json={"xml": xml, **more}, timeout=30)
    assert answer.status_code < 500, answer.text
    said = answer.text
    if answer.status_code == 202:
        job = f"{path}/{answer.json()['id']}"
        while (answer := await browser.http.get(job)).json()["state"] == "running":
            assert answer.status_code == 200
        said += answer.text
        assert answer.json()["state"] == "failed"
    elif method == "PUT" and answer.status_code == 200:
        said += (await browser.http.get(path)).text
    return said


@pytest.mark.parametrize("attack", [xxe, parameter_entity, external_dtd])
async def test_no_file_makes_the_server_read_another(
    world: MakeWorld, tmp_path: Path, attack: Attack
) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text(SECRET)
    async with world() as here:
        for method, path, more in (*ROUTES, *(ORDERS if attack is xxe else ())):
            said = await sent(here, method, path, attack(secret), more)
            assert SECRET not in said
            assert "document type" in said.lower() or "dtd" in said.lower(), path


async def test_what_is_to_be_included_is_not(world: MakeWorld, tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text(SECRET)
    async with world() as here:
        for method, path, more in ROUTES:
            assert SECRET not in await sent(here, method, path, xinclude(secret), more)


@pytest.mark.parametrize("attack", [billion_laughs, quadratic, deep, endless, nothing])
async def test_no_file_swells_or_holds_up_the_server(
    world: MakeWorld, tmp_path: Path, attack: Attack
) -> None:
    async with world() as here:
        for method, path, more in (*ROUTES, *(ORDERS if attack is billion_laughs else ())):
            began = time.perf_counter()
            said = await sent(here, method, path, attack(tmp_path), more)
            assert time.perf_counter() - began < QUICK_S
            assert len(said) < 100_000
        assert (await here.asked()).text


async def test_what_is_well_passes_them_all(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        xml = scenarios.question().decode()
        for method, path, more in (*ROUTES, *ORDERS):
            body = {"xml": xml, **more}
            answer = await browser.http.request(method, path, json=body, timeout=30)
            assert answer.status_code in (200, 201, 202), answer.text
