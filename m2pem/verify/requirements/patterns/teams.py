"""Patterns of missions with several robots and an operator."""

import itertools

from m2pem.mission.expression import parse as parse_expression
from m2pem.verify.ltl.formula import (
    FALSE,
    Active,
    Always,
    And,
    Commanded,
    Completed,
    Count,
    Data,
    Ended,
    Eventually,
    Formula,
    Implies,
    Not,
    Once,
    Or,
    WeakUntil,
    conjunction,
    disjunction,
)
from m2pem.verify.requirements.patterns.pattern import (
    WHEN,
    WITHIN,
    Argument,
    Arguments,
    Kind,
    Pattern,
    Surroundings,
    Words,
    say_soon,
    soon,
)

_RESOURCE = Argument("resource", Kind.RESOURCE)


def _visits_at_least(a: Arguments, around: Surroundings) -> Formula:
    places = around.places_of(a["resource"], a["behavior"])
    done = [disjunction([Completed(task) for task in tasks]) for tasks in places.values()]
    if not done:
        return FALSE
    if a["revisits"]:
        return Eventually(Count((disjunction(done),), ">=", a["times"]))
    return Eventually(Count(tuple(Once(each) for each in done), ">=", a["times"]))


def _say_visits(a: Arguments, words: Words) -> str:
    where = f"{a['times']} times" if a["revisits"] else f"at {a['times']} different places"
    return f"{a['resource']} completes {a['behavior']} {where} at least"


def _in_time(a: Arguments) -> str:
    said = say_soon(a, "")
    return f" {said}" if said else ""


def _mutual_exclusion(a: Arguments, _: Surroundings) -> Formula:
    active = [Active(each) for each in a["elements"]]
    return Always(conjunction([Not(And(pair)) for pair in itertools.combinations(active, 2)]))


def _decided(a: Arguments, around: Surroundings) -> Formula:
    asked: Formula = Completed(a["ask"])
    if a["decision"] is None:
        return asked
    store, decision = around.store_of(a["ask"]), a["decision"].replace("'", "\\'")
    return And((asked, Data(parse_expression(f"{store} == '{decision}'", "m2pem"))))


def _operator_in_the_loop(a: Arguments, around: Surroundings) -> Formula:
    action, decided = a["before"], _decided(a, around)
    each_time = WeakUntil(action, And((Not(action), WeakUntil(Not(action), decided))))
    return And((WeakUntil(Not(action), decided), Always(Implies(action, each_time))))


def _say_operator(a: Arguments, words: Words) -> str:
    answer = f" with '{a['decision']}'" if a["decision"] is not None else ""
    return (
        f"each time before {words.of(a['before'])}, an operator has answered "
        f"{words.element(a['ask'])}{answer}"
    )


TEAMS = (
    Pattern(
        "visits_at_least",
        "the resource completes the behavior at so many different places at least. A place is the "
        "route, area or target of the task; with `revisits: true`, each time counts",
        (
            _RESOURCE,
            Argument("behavior", Kind.BEHAVIOR),
            Argument("times", Kind.COUNT),
            Argument("revisits", Kind.FLAG, required=False, default=False),
        ),
        _visits_at_least,
        _say_visits,
        scoped=False,
    ),
    Pattern(
        "mutual_exclusion",
        "of the elements, no two are active at once",
        (Argument("elements", Kind.ELEMENTS),),
        _mutual_exclusion,
        lambda a, words: (
            "never two at once of: " + ", ".join(words.element(each) for each in a["elements"])
        ),
    ),
    Pattern(
        "operator_in_the_loop",
        "each time before the condition holds, an operator has answered a user task, with a "
        "decision if one is named; one answer is good for one time",
        (
            Argument("ask", Kind.ELEMENT),
            Argument("decision", Kind.DECISION, required=False),
            Argument("before", Kind.CONDITION),
        ),
        _operator_in_the_loop,
        _say_operator,
    ),
    Pattern(
        "reaches_proper_end",
        "the run comes to an end of the model, not to a failure",
        (WITHIN,),
        lambda a, _: soon(a, Or((Ended("completed"), Ended("terminated")))),
        lambda a, _words: f"the mission comes to an end that the model means{_in_time(a)}",
        scoped=False,
        fair=True,
    ),
    Pattern(
        "no_command_after",
        "once the condition has held, the resource is commanded no more",
        (_RESOURCE, WHEN),
        lambda a, _: Always(Implies(a["when"], Always(Not(Commanded(a["resource"]))))),
        lambda a, words: f"once {words.of(a['when'])}, {a['resource']} is commanded no more",
    ),
    Pattern(
        "commanded_again",
        "whenever the condition holds, the resource is commanded then or later, or the run ends",
        (_RESOURCE, WHEN, WITHIN),
        lambda a, _: Always(Implies(a["when"], soon(a, Or((Commanded(a["resource"]), Ended()))))),
        lambda a, words: (
            f"whenever {words.of(a['when'])}, {a['resource']} is commanded "
            f"{say_soon(a, 'then or later')}, or the mission ends"
        ),
    ),
)
