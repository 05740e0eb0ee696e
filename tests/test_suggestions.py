from m2pem.suggestions import did_you_mean, suggest


def test_a_near_name_is_suggested_whatever_its_case() -> None:
    assert did_you_mean("EVSG", ["evsg1", "uav1"]) == "did you mean 'evsg1'?"


def test_nothing_is_suggested_for_a_name_that_is_like_no_other() -> None:
    assert did_you_mean("zebra", ["evsg1", "uav1"]) == ""


def test_without_a_near_name_the_known_ones_are_listed() -> None:
    assert suggest("zebra", ["evsg1", "uav1"], "vehicles") == "known vehicles: evsg1, uav1"


def test_a_long_list_is_cut() -> None:
    hint = suggest("zebra", [f"v{i:03}" for i in range(100)], "vehicles")
    assert hint.endswith("v011, ...")


def test_an_empty_list_is_said_to_be_empty() -> None:
    assert suggest("zebra", [], "vehicles") == "there are no vehicles"
