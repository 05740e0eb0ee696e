"""What all contracts share: what their authors may declare unsupported, and that it is told."""

import difflib
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NoReturn, TypeVar

import pytest

NOT_SUPPORTED = "not supported: "
"""How the reason of a skipped test begins; the report at the end looks for it."""

Test = TypeVar("Test", bound=Callable[..., Any])


def needs(*subjects: str) -> Callable[[Test], Test]:
    """Marks a test of a contract as one of subjects that may be declared unsupported."""

    def mark(test: Test) -> Test:
        test.__dict__["m2pem_needs"] = subjects
        return test

    return mark


def skip_unsupported(subject: str, why: str) -> NoReturn:
    """Skip a test so that the report at the end lists it."""
    pytest.skip(f"{NOT_SUPPORTED}{subject}: {why}")


class Contract:
    """Tests to inherit. `unsupported` says what is not supported, and why, by subject.

    `subjects` are those that may be in it, each with what it means. Everything else must be kept.
    """

    m2pem_contract: ClassVar[str] = ""
    subjects: ClassVar[Mapping[str, str]] = {}
    unsupported: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Refuses what cannot be declared.

        Raises:
            TypeError: `unsupported` has a subject that there is not, or no reason for one.
        """
        super().__init_subclass__(**options)
        for subject, why in cls.unsupported.items():
            if subject not in cls.subjects:
                near = difflib.get_close_matches(subject, cls.subjects, n=1)
                hint = f"did you mean {near[0]!r}? " if near else ""
                raise TypeError(
                    f"{cls.__name__}.unsupported: {subject!r} cannot be declared unsupported;"
                    f" {hint}{cls.m2pem_contract} knows: {', '.join(cls.subjects) or 'nothing'}"
                )
            if not isinstance(why, str) or not why.strip():
                raise TypeError(f"{cls.__name__}.unsupported[{subject!r}] must say why")

    @pytest.fixture(autouse=True)
    def m2pem_supported(self, request: pytest.FixtureRequest) -> None:
        """Skips the tests of what is declared unsupported."""
        for subject in getattr(request.function, "m2pem_needs", ()):
            if subject in self.unsupported:
                skip_unsupported(subject, self.unsupported[subject])
