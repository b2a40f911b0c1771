"""Plug-ins by name."""

from importlib.metadata import entry_points

import pytest

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.plugins import ESTIMATORS, POLICIES, find, names

ALL = [(group, name) for group in (ESTIMATORS, POLICIES) for name in names(group)]


def test_the_estimators_and_policies_of_the_package_are_there() -> None:
    assert {"correlation", "revolution", "north_gls", "levelling"} <= set(names(ESTIMATORS))
    assert {"constant_rate", "bidirectional", "rate_choice"} <= set(names(POLICIES))


@pytest.mark.parametrize(("group", "name"), ALL)
def test_every_plug_in_that_is_named_can_be_found(group: str, name: str) -> None:
    found = find(group, name)
    wanted = ("reset", "act") if group == POLICIES else ("reset", "update", "estimate")
    assert all(callable(getattr(found, method)) for method in wanted)
    assert entry_points(group=group, name=name)


def test_a_plug_in_may_be_named_by_its_module() -> None:
    found = find(ESTIMATORS, "env_cases:Sure")
    assert found.__name__ == "Sure"
    assert found(Datasheet(100.0, 10.0)).datasheet.dt == 0.01


@pytest.mark.parametrize(
    ("group", "name", "sentence"),
    [
        (ESTIMATORS, "nort_gls", "estimator 'nort_gls' is not installed; did you mean 'north_gls'?"),
        (POLICIES, "xyzzy", "policy 'xyzzy' is not installed; wanted one of bidirectional, "),
        (ESTIMATORS, "no_such_module:Name", "estimator 'no_such_module:Name' cannot be imported"),
        (ESTIMATORS, "env_cases:Nothing", "cannot be imported"),
        (ESTIMATORS, ":Name", "cannot be imported"),
        (ESTIMATORS, "env_cases:", "cannot be imported"),
        (POLICIES, "env_cases:ID", "policy 'env_cases:ID' is a str; wanted a class"),
        (ESTIMATORS, "", "estimator '' is not installed"),
    ],
)
def test_others_are_refused_in_one_sentence(group: str, name: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        find(group, name)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)
