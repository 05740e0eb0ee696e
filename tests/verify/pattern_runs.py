"""For each pattern, runs that keep to it and runs that do not.

A run is written moment by moment; what is true in a moment are letters, `-` is a quiet moment, and
what stands behind `|` comes again and again. Without `|` the run stays quiet after its end.
"""

GOOD_AND_BAD: dict[str, tuple[dict[str, object], list[str], list[str]]] = {
    "visit": ({"locations": ["a", "b"]}, ["b a", "a - a b", "| a b"], ["a", "-", "| a"]),
    "sequenced_visit": (
        {"locations": ["a", "b"]},
        ["a b", "b a b", "a - - b", "| b a"],
        ["b a", "a", "b | a"],
    ),
    "ordered_visit": (
        {"locations": ["a", "b"]},
        ["a b", "a a b b", "a - b a", "a - a - b"],
        ["b a b", "b", "a", "b a"],
    ),
    "strict_ordered_visit": (
        {"locations": ["a", "b"]},
        ["a b", "a a b a", "a - b b a"],
        ["a - a b", "b a b", "a"],
    ),
    "fair_visit": (
        {"locations": ["a", "b"]},
        ["a b", "b a", "a - b - a - b", "| a b"],
        ["a - a b", "a", "b a - a"],
    ),
    "patrolling": ({"locations": ["a", "b"]}, ["| a b", "b | b - a"], ["a b", "a | b", "a b a b"]),
    "sequenced_patrolling": (
        {"locations": ["a", "b"]},
        ["| a b", "| b a", "b b | a - b"],
        ["| a", "a b a b", "b | a"],
    ),
    "ordered_patrolling": (
        {"locations": ["a", "b"]},
        ["| a b", "| a - a b", "a | a b"],
        ["| b a", "a | b - b a", "a b"],
    ),
    "strict_ordered_patrolling": (
        {"locations": ["a", "b"]},
        ["| a b", "a | a b a a - b", "| a a - b b"],
        ["| a - a b", "| b a", "a b - b | a b"],
    ),
    "fair_patrolling": (
        {"locations": ["a", "b"]},
        ["| a b", "| b a", "| a - b -"],
        ["a b", "| a - a b", "a - a | b a"],
    ),
    "past_avoidance": (
        {"avoid": "a", "until": "b"},
        ["b a", "- b", "c c b a a"],
        ["a b", "-", "c a b"],
    ),
    "global_avoidance": ({"avoid": "a"}, ["-", "b c", "| b"], ["a", "b - a", "| b - a"]),
    "future_avoidance": (
        {"avoid": "a", "when": "b"},
        ["a a b", "a", "b c", "| a"],
        ["b a", "a b - a", "| b a"],
    ),
    "upper_restricted_avoidance": (
        {"avoid": "a", "times": 2},
        ["a b a", "-", "a a a a - a", "| b"],
        ["a b a b a", "| a b"],
    ),
    "lower_restricted_avoidance": (
        {"avoid": "a", "times": 2},
        ["a b a", "| a b", "a - a - a"],
        ["a", "a a a", "-"],
    ),
    "exact_restricted_avoidance": (
        {"avoid": "a", "times": 2},
        ["a b a", "a a - a a"],
        ["a", "a b a b a", "| a b"],
    ),
    "instantaneous_reaction": (
        {"when": "a", "then": "b"},
        ["ab", "-", "b ab b", "| ab"],
        ["a", "a b", "| ab a"],
    ),
    "delayed_reaction": (
        {"when": "a", "then": "b"},
        ["a b", "ab", "a - - b", "-", "| a b"],
        ["a", "b a", "a b - a"],
    ),
    "prompt_reaction": (
        {"when": "a", "then": "b"},
        ["a b", "-", "a ab b", "| a b"],
        ["a - b", "ab", "a"],
    ),
    "bound_reaction": ({"when": "a", "then": "b"}, ["ab", "-", "| ab c"], ["a", "b", "ab b"]),
    "bound_delay": (
        {"when": "a", "then": "b"},
        ["a b", "-", "b", "a ab b"],
        ["- b", "a - b", "a b b"],
    ),
    "wait": ({"hold": "a", "until": "b"}, ["a a b", "b", "ab b"], ["a", "a - b", "-"]),
    "absence": ({"what": "a"}, ["-", "b"], ["a", "b - a"]),
    "existence": ({"what": "a"}, ["a", "b - a"], ["-", "| b"]),
    "bounded_existence": (
        {"what": "a", "times": 2},
        ["-", "a b a", "a a a - a a"],
        ["a b a b a", "| a b"],
    ),
    "universality": ({"what": "a"}, ["| a", "a | ab"], ["a", "-", "| a b"]),
    "precedence": ({"first": "a", "then": "b"}, ["a b", "ab", "a", "-"], ["b", "b a", "c b"]),
    "response": ({"when": "a", "then": "b"}, ["a b", "ab", "-"], ["a", "b a"]),
    "chain_precedence": (
        {"first": ["a", "b"], "then": "c"},
        ["a b c", "a - b - c c", "a", "b", "-", "a b a c"],
        ["c", "a c b", "b a c", "a c"],
    ),
    "precedence_chain": (
        {"first": "a", "then": ["b", "c"]},
        ["a b c", "b", "c b", "-"],
        ["b c", "b a c", "c b c"],
    ),
    "response_chain": (
        {"when": "a", "then": ["b", "c"]},
        ["a b c", "-", "b c", "a c b c"],
        ["a", "a c b", "a b", "b c a"],
    ),
    "chain_response": (
        {"when": ["a", "b"], "then": "c"},
        ["a b c", "a", "b", "b a", "a b - c"],
        ["a b", "a c b", "a b c b"],
    ),
    "no_command_after": (
        {"resource": "uav1", "when": "a"},
        ["u a", "u - u a b", "u"],
        ["a u", "u a - u"],
    ),
    "commanded_again": (
        {"resource": "uav1", "when": "a"},
        ["a u", "a - u", "a e", "-"],
        ["a", "u a", "u e - a"],
    ),
    "mutual_exclusion": ({"elements": ["A", "B"]}, ["x y", "x - y", "x"], ["xy", "x xy y"]),
    "reaches_proper_end": ({}, ["a e", "| e"], ["a", "-", "| a f"]),
    "operator_in_the_loop": (
        {"ask": "a", "before": "b"},
        ["a b", "-", "a", "a b a b", "a b b b"],
        ["b", "b a", "a b - b", "a a b - b"],
    ),
    "visits_at_least": (
        {"resource": "uav1", "behavior": "area_survey", "times": 2},
        ["s t", "t - - s"],
        ["s", "s - s", "-"],
    ),
}

OF_PART: list[tuple[str, dict[str, object], list[str], list[str]]] = [
    ("absence", {"what": "a", "before": "b"}, ["b a", "a", "- b"], ["a b", "- a b"]),
    ("absence", {"what": "a", "after": "b"}, ["a b", "a", "b c"], ["b a", "a b a"]),
    (
        "absence",
        {"what": "a", "after": "b", "before": "c"},
        ["b c a", "b a", "a b c"],
        ["b a c", "b c b a c"],
    ),
    (
        "absence",
        {"what": "a", "after": "b", "until": "c"},
        ["b c a", "a b c a"],
        ["b a", "b a c", "b c b a"],
    ),
    ("existence", {"what": "a", "before": "b"}, ["a b", "-", "a"], ["b", "b a"]),
    ("existence", {"what": "a", "after": "b"}, ["b a", "-", "a", "ab"], ["b", "a b"]),
    (
        "existence",
        {"what": "a", "after": "b", "before": "c"},
        ["b a c", "b", "b a c b"],
        ["b c", "a b c", "b a c b c"],
    ),
    (
        "existence",
        {"what": "a", "after": "b", "until": "c"},
        ["b a c", "b a", "-"],
        ["b", "b c a", "b a c b"],
    ),
    (
        "bounded_existence",
        {"what": "a", "times": 1, "before": "b"},
        ["a b a a", "a c a"],
        ["a c a b"],
    ),
    ("bounded_existence", {"what": "a", "times": 1, "after": "b"}, ["a c a b a"], ["b a c a"]),
    ("universality", {"what": "a", "after": "b", "before": "c"}, ["ab a c", "b"], ["ab - c"]),
    (
        "precedence",
        {"first": "a", "then": "c", "before": "b"},
        ["a c b", "c", "b c"],
        ["c b", "c a b"],
    ),
    ("precedence", {"first": "a", "then": "c", "after": "b"}, ["c b a c", "c"], ["b c", "a b c"]),
    (
        "response",
        {"when": "a", "then": "c", "after": "b", "before": "u"},
        ["b a c u", "a b u", "b a"],
        ["b a u", "b a u c"],
    ),
    (
        "response_chain",
        {"when": "a", "then": ["c", "u"], "before": "b"},
        ["a c u b", "a"],
        ["a c b u"],
    ),
    ("ordered_visit", {"locations": ["a", "c"], "after": "b"}, ["c b a c", "-"], ["a b c", "b"]),
]
