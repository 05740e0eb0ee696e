"""The base of all contracts: subjects that authors may declare unsupported, with a reason."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NoReturn, TypeVar

import pytest

from m2pem.suggestions import nearest

NOT_SUPPORTED = "not supported: "
"""Prefix of the reason of a skipped test; the summary at the end searches for it."""

Test = TypeVar("Test", bound=Callable[..., Any])


def needs(*subjects: str) -> Callable[[Test], Test]:
    """Mark a test of a contract with the subjects that it needs."""

    def mark(test: Test) -> Test:
        test.__dict__["m2pem_needs"] = subjects
        return test

    return mark


def takes(test: Callable[..., None], *fixtures: str) -> Callable[..., None]:
    """Say to pytest which fixtures a test takes that was made of a coroutine method."""
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = [inspect.Parameter(name, kind) for name in ("self", *fixtures)]
    test.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return test


def skip_unsupported(subject: str, why: str) -> NoReturn:
    """Skip a test so that the summary at the end lists it."""
    pytest.skip(f"{NOT_SUPPORTED}{subject}: {why}")


class Contract:
    """Tests to inherit. `unsupported`: subjects that are not supported, each with the reason.

    `subjects`: those that may be in it, each with its meaning. All other tests must pass.
    """

    m2pem_contract: ClassVar[str] = ""
    subjects: ClassVar[Mapping[str, str]] = {}
    unsupported: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Check the declarations of a subclass.

        Raises:
            TypeError: `unsupported` has an unknown subject, or one without a reason.
        """
        super().__init_subclass__(**options)
        for subject, why in cls.unsupported.items():
            if subject not in cls.subjects:
                near = nearest(subject, cls.subjects, 0.6)
                hint = f"did you mean {near!r}? " if near else ""
                raise TypeError(
                    f"{cls.__name__}.unsupported: {subject!r} cannot be declared unsupported;"
                    f" {hint}{cls.m2pem_contract} knows: {', '.join(cls.subjects) or 'nothing'}"
                )
            if not isinstance(why, str) or not why.strip():
                raise TypeError(f"{cls.__name__}.unsupported[{subject!r}] must say why")

    @pytest.fixture(autouse=True)
    def m2pem_supported(self, request: pytest.FixtureRequest) -> None:
        """Skip the tests of subjects that are declared unsupported."""
        for subject in getattr(request.function, "m2pem_needs", ()):
            if subject in self.unsupported:
                skip_unsupported(subject, self.unsupported[subject])
