"""Several tabs: one acts, and another one takes over unless that objects in time."""

from __future__ import annotations

import pytest

from farhand.local_site.view.sessions import OBJECT_S, Role, Sessions


@pytest.fixture
def two() -> Sessions:
    """Tab 1 is active, tab 2 watches."""
    sessions = Sessions()
    sessions.joined(1)
    sessions.joined(2)
    return sessions


def test_a_tab_takes_over_after_the_time_in_which_the_other_one_may_object(two: Sessions) -> None:
    two.ask(2, 10.0)
    assert two.asker == 2 and two.role(1) is Role.ACTIVE
    assert not two.take_over_if_due(10.0 + 0.9 * OBJECT_S)
    assert two.acts(1)
    assert two.take_over_if_due(10.0 + OBJECT_S)
    assert (two.role(1), two.role(2)) == (Role.WATCHING, Role.ACTIVE)
    assert two.asker is None and not two.take_over_if_due(1000.0)


def test_who_objects_keeps_control(two: Sessions) -> None:
    two.ask(2, 10.0)
    assert two.keep(2) is None  # only the active tab may object
    assert two.keep(1) == 2
    assert not two.take_over_if_due(1000.0) and two.role(1) is Role.ACTIVE
    assert two.keep(1) is None


def test_a_request_ends_with_either_tab(two: Sessions) -> None:
    two.ask(2, 10.0)
    two.left(2)
    assert not two.take_over_if_due(1000.0) and two.role(1) is Role.ACTIVE
    two.joined(3)
    two.ask(3, 10.0)
    two.left(1)
    assert two.asker is None and two.role(3) is Role.FREE and two.acts(3)


def test_neither_the_active_tab_nor_one_that_is_not_open_asks(two: Sessions) -> None:
    two.ask(1, 10.0)
    two.ask(7, 10.0)
    assert two.asker is None
    two.ask(2, 10.0)
    two.joined(3)
    two.ask(3, 12.0)  # the first that asked comes first
    assert two.asker == 2
