import click
import pytest

from m2pem.cli.options import as_json, data_option


def read(*words: str) -> dict[str, object]:
    found: list[dict[str, object]] = []

    @click.command()
    @data_option
    def command(data: dict[str, object]) -> None:
        found.append(data)

    command.main(list(words), standalone_mode=False)
    return found[0]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2", 2),
        ("2.5", 2.5),
        ("0o14", 12),
        ("true", True),
        ("yes", "yes"),
        ("null", None),
        ("", None),
        ("gpr", "gpr"),
        ("'2'", "2"),
        ("[north, east]", ["north", "east"]),
        ("{a: {b: 1}}", {"a": {"b": 1}}),
        ("2026-01-01", "2026-01-01"),
        ("a=b", "a=b"),
        ("5 m/s", "5 m/s"),
    ],
)
def test_a_value_is_yaml_1_2(text: str, value: object) -> None:
    data = read("--data", f"mission.x={text}")
    assert data == {"mission.x": value}
    assert type(data["mission.x"]) is type(value)


def test_several_values_are_kept_in_order() -> None:
    assert list(read("--data", "b=1", "--data", "a=2").items()) == [("b", 1), ("a", 2)]


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("speed", "'speed' is not of the form NAME=VALUE"),
        ("=5", "'=5' is not of the form NAME=VALUE"),
        ("a=[1,", "the value of a: is not YAML"),
        ("a=.inf", "the value of a: .inf is not a finite"),
        ("a=!!python/none", "the value of a: the tag"),
        ("a={b: 1, b: 2}", "the value of a: 'b' stands twice"),
    ],
)
def test_what_is_no_value_is_refused(word: str, said: str) -> None:
    with pytest.raises(click.BadParameter) as refusal:
        read("--data", word)
    assert said in refusal.value.message


def test_a_name_given_twice_is_refused() -> None:
    with pytest.raises(click.BadParameter, match="a is given twice"):
        read("--data", "a=1", "--data", "a=2")


def test_json_is_for_people_too() -> None:
    assert as_json({"a": [1]}) == '{\n  "a": [\n    1\n  ]\n}'
