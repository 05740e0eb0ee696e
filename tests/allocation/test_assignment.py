"""The choice for all tasks together, compared with every possible choice on small fleets."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

from hypothesis import given
from hypothesis import strategies as st

from m2pem.allocation.assignment import Request, RoleOptions, assign
from m2pem.mission.catalogue import ResourceId

FLEET = tuple(ResourceId(name) for name in ("a", "b", "c", "d", "e"))
ORDER = {resource: place for place, resource in enumerate(FLEET)}

Choice = dict[str, dict[str, tuple[ResourceId, ...]]]


def role(
    name: str = "r", least: int = 1, most: int = 0, busy: Sequence[str] = (), **costs_s: float
) -> RoleOptions:
    costs = {ResourceId(resource): cost for resource, cost in costs_s.items()}
    return RoleOptions(name, least, most or least, costs, tuple(map(ResourceId, busy)))


def ask(number: str, *roles: RoleOptions) -> Request:
    return Request(number, roles)


def choose(*requests: Request) -> Choice:
    return assign(requests, ORDER)


def test_the_cheapest_choice_for_all_is_not_the_cheapest_for_each() -> None:
    chosen = choose(ask("r1.a1", role(a=1, b=2)), ask("r2.a1", role(a=1, b=100)))
    assert chosen == {"r1.a1": {"r": ("b",)}, "r2.a1": {"r": ("a",)}}


def test_of_equal_choices_the_first_of_the_fleet_is_taken() -> None:
    assert choose(ask("r1.a1", role(c=5, b=5, a=5))) == {"r1.a1": {"r": ("a",)}}


def test_the_first_request_is_served_where_not_all_can_be() -> None:
    assert choose(ask("r1.a1", role(a=9)), ask("r2.a1", role(a=1))) == {"r1.a1": {"r": ("a",)}}


def test_a_request_gets_all_of_its_roles_or_nothing() -> None:
    chosen = choose(ask("r1.a1", role("x", a=1), role("y", a=1)), ask("r2.a1", role(a=1)))
    assert chosen == {"r2.a1": {"r": ("a",)}}


def test_a_request_that_waits_for_several_keeps_what_is_free() -> None:
    waiting = ask("r1.a1", role(least=2, a=1, busy=["b"]))
    assert choose(waiting, ask("r2.a1", role(a=1, c=50))) == {"r2.a1": {"r": ("c",)}}


def test_a_request_that_lacks_something_else_keeps_what_it_names_from_those_in_turn() -> None:
    waiting = Request("r1.a1", (role(busy=["a"]),), keeps=["a"])
    later = ask("r2.a1", role(a=1))
    assert choose(waiting, later) == {}
    assert choose(waiting, replace(later, in_turn=False)) == {"r2.a1": {"r": ("a",)}}
    assert choose(later, waiting) == {"r2.a1": {"r": ("a",)}}


def test_it_keeps_its_own_also_when_the_rest_is_kept_by_one_before_it() -> None:
    first = ask("r1.a1", role(least=2, a=1, busy=["b"]))
    waiting = ask("r2.a1", role(least=2, a=1, c=1))
    assert choose(first, waiting, ask("r3.a1", role(c=1))) == {}


def test_it_does_not_keep_more_of_a_role_than_it_needs() -> None:
    waiting = ask("r1.a1", role("x", a=1, b=1), role("y", busy=["c"]))
    assert choose(waiting, ask("r2.a1", role(a=1, b=1))) == {"r2.a1": {"r": ("b",)}}


def test_a_request_that_does_not_wait_keeps_nothing() -> None:
    fails = Request("r1.a1", (role(least=2, a=1, busy=["b"]),), waits=False)
    assert choose(fails, ask("r2.a1", role(a=1))) == {"r2.a1": {"r": ("a",)}}


def test_a_request_for_what_is_lost_keeps_nothing() -> None:
    hopeless = ask("r1.a1", role(least=2, a=1))
    assert choose(hopeless, ask("r2.a1", role(a=1))) == {"r2.a1": {"r": ("a",)}}


def test_a_range_takes_as_many_as_are_free_after_all_were_served() -> None:
    team = ask("r1.a1", role(least=1, most=3, a=1, b=1, c=1))
    assert choose(team)["r1.a1"]["r"] == ("a", "b", "c")
    chosen = choose(team, ask("r2.a1", role(b=9)))
    assert chosen == {"r1.a1": {"r": ("a", "c")}, "r2.a1": {"r": ("b",)}}


def test_an_optional_role_does_not_keep_a_task_from_beginning() -> None:
    chosen = choose(ask("r1.a1", role("x", a=1), role("y", least=0, most=1, a=1)))
    assert chosen == {"r1.a1": {"x": ("a",)}}


COSTS = st.dictionaries(st.sampled_from(FLEET), st.integers(-20, 100).map(float), max_size=5)


def requests_of(roles: "st.SearchStrategy[list[tuple[int, dict[ResourceId, float]]]]"):
    """Up to four requests with such roles: how many, and what each resource costs."""
    return st.lists(roles, max_size=4).map(
        lambda drawn: [
            Request(
                f"r{number}.a1",
                tuple(
                    RoleOptions(f"role{place}", least, least, costs_s)
                    for place, (least, costs_s) in enumerate(each)
                ),
            )
            for number, each in enumerate(drawn)
        ]
    )


ONE_EACH = requests_of(st.lists(st.tuples(st.just(1), COSTS), min_size=1, max_size=1))
SEVERAL = requests_of(st.lists(st.tuples(st.integers(1, 2), COSTS), min_size=1, max_size=2))


def fillings(request: Request) -> Iterator[dict[str, tuple[ResourceId, ...]]]:
    """Every way to fill the roles of a request."""
    ways = [combinations(sorted(each.costs_s), each.least) for each in request.roles]
    for way in product(*ways):
        used = [resource for chosen in way for resource in chosen]
        if len(used) == len(set(used)):
            yield {each.name: chosen for each, chosen in zip(request.roles, way, strict=True)}


def every_choice(requests: Sequence[Request]) -> Iterator[tuple[Choice, float]]:
    """Every way to serve all the requests, with its cost."""
    for way in product(*(list(fillings(each)) for each in requests)):
        used = [each for roles in way for chosen in roles.values() for each in chosen]
        if len(used) == len(set(used)):
            choice = {each.id: roles for each, roles in zip(requests, way, strict=True)}
            yield choice, cost_of(choice, requests)


def cost_of(
    choice: Mapping[str, Mapping[str, Sequence[ResourceId]]], requests: Sequence[Request]
) -> float:
    return sum(
        each.costs_s[resource]
        for request in requests
        for each in request.roles
        for resource in choice.get(request.id, {}).get(each.name, ())
    )


@given(ONE_EACH)
def test_the_choice_is_that_of_trying_everything(requests: list[Request]) -> None:
    served: list[Request] = []
    for request in requests:  # in their order, each that can be served beside those before it
        if next(every_choice([*served, request]), None) is not None:
            served.append(request)
    chosen = choose(*requests)
    assert chosen.keys() == {each.id for each in served}
    assert cost_of(chosen, requests) == min(cost for _, cost in every_choice(served))
    assert chosen == choose(*requests)


def test_later_ones_get_nothing_that_one_which_waits_for_several_could_have() -> None:
    some = [each for n in (1, 2, 3) for each in combinations("abc", n)]
    roles = [role(least=n, busy="xy", **dict.fromkeys(each, 1.0)) for each in some for n in (1, 2)]
    for asked in product(roles, repeat=3):
        chosen = choose(*(ask(f"r{number}.a1", each) for number, each in enumerate(asked)))
        if asked[1].least == 2 and "r1.a1" not in chosen:
            given_later = chosen.get("r2.a1", {"r": ()})["r"]
            assert asked[1].costs_s.keys().isdisjoint(given_later)


@given(SEVERAL)
def test_tasks_with_several_roles_get_all_of_them_at_the_least_cost(
    requests: list[Request],
) -> None:
    chosen = choose(*requests)
    served = [each for each in requests if each.id in chosen]
    ways = list(every_choice(served))
    assert any(choice.keys() == chosen.keys() for choice, _ in ways)
    used = [each for roles in chosen.values() for ids in roles.values() for each in ids]
    assert len(used) == len(set(used))
    for request in served:
        assert {each.name: each.least for each in request.roles} == {
            name: len(ids) for name, ids in chosen[request.id].items()
        }
    # The first one is served if it can be, and nobody gets a worse choice than there is.
    if requests and next(every_choice(requests[:1]), None) is not None:
        assert requests[0].id in chosen
    if len(served) == len(requests):
        assert cost_of(chosen, requests) == min(cost for _, cost in ways)
