from __future__ import annotations

import numpy as np

from farhand.remote_site.insertion.beside import BesideRule

BESIDE, BEFORE, INSIDE = (np.array(tip) for tip in ((0.03, 0.0, 0.0), (0.03, 0.0, -0.03), (0.001, 0.0, 0.02)))


def test_without_a_jump_nothing_is_beside():
    assert not BesideRule().beside(BESIDE)


def test_after_a_jump_a_plug_behind_the_mouth_and_off_the_axis_is_beside():
    rule = BesideRule()
    rule.jumped()
    assert rule.beside(BESIDE) and not rule.beside(BEFORE) and not rule.beside(np.array([0.015, 0.0, 0.0]))


def test_once_inside_the_jump_is_over():
    rule = BesideRule()
    rule.jumped()
    assert not rule.beside(INSIDE)
    assert not rule.beside(BESIDE)
