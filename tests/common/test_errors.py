from __future__ import annotations

import pickle

import pytest

from farhand.common.errors import FarhandError, InvalidInput


def every_invalid_input() -> list[type[InvalidInput]]:
    return [InvalidInput, *InvalidInput.__subclasses__()]


@pytest.mark.parametrize("kind", every_invalid_input())
def test_it_says_what_is_wrong_where(kind):
    assert str(kind("a.npz", "time_s", "increasing times")) == "a.npz: time_s: increasing times"
    assert str(kind("a.npz", "", "a whole file")) == "a.npz: a whole file"
    assert issubclass(kind, FarhandError)


@pytest.mark.parametrize("kind", every_invalid_input())
def test_it_comes_whole_out_of_another_process(kind):
    sent = kind("a.npz", "time_s", "increasing times")
    arrived = pickle.loads(pickle.dumps(sent))
    assert type(arrived) is kind
    assert (str(arrived), arrived.source, arrived.field) == (str(sent), "a.npz", "time_s")
