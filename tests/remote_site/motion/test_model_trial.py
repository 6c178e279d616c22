"""A model that is well-formed but of no use is refused with its field, before anybody executes it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from farhand.common.errors import InvalidModel
from farhand.common.mode_table import Action
from farhand.common.model.model_file import content_hash, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import MAX_COMPONENTS, TPHSMM
from farhand.common.task import TaskSet
from farhand.common.wire.messages import ModelTransfer, Stamp
from farhand.remote_site.motion.model_store import _MOST_KEPT, ModelStore
from farhand.remote_site.motion.model_trial import ModelTrial, _check_numbers, _try_out
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from tests.messages import said
from tests.remote_site.bench import Bench
from tests.remote_site.planar import TASK, cyclic, planar_model, transfer
from tests.strategies import learned


def trial_of(model: TPHSMM) -> ModelTrial:
    content = encode(model)
    return ModelTrial(
        ModelTransfer(task=TASK.name, sha256=content_hash(content), content=content), content, TASK
    )


def with_one(name: str, value: Any, component: int = 2) -> TPHSMM:
    """The planar model with something else in one of its components."""
    model = planar_model()
    array = np.array(getattr(model, name))
    array[(..., component) if array.ndim == 1 else (slice(None), component)] = value
    return replace(model, **{name: array})


EYE = np.eye(2)
WILD: dict[str, tuple[str, Any]] = {
    "starts that are denormal": ("start_covariances", 6e-8**2 * EYE),
    "a wide start beside a denormal one": ("start_covariances", np.diag([6e2**2, 6e-8**2])),
    "starts as wide as the sea": ("start_covariances", 6e2**2 * EYE),
    "a denormal covariance": ("covariances", 1e-30 * EYE),
    "a vast covariance": ("covariances", 1e5 * EYE),
    "a flat covariance": ("covariances", np.diag([1e3, 1e-11])),
    "a denormal residual": ("residual_covariances", 1e-20 * EYE),
    "centuries": ("duration_mean_s", 1e5),
    "an elapsed century": ("elapsed_mean_s", 1e5),
    "a mean on the moon": ("means", 3.8e5),
    "a start on the moon": ("start_means", 3.8e5),
    "a slope like light": ("slopes", 3e5),
}


@pytest.mark.parametrize("case", WILD)
def test_what_nobody_demonstrates_is_refused_with_its_field(case: str):
    field, value = WILD[case]
    outcome = trial_of(with_one(field, value)).outcome()
    assert isinstance(outcome, InvalidModel) and outcome.field == field
    bench = Bench().armed()
    reply = bench.send_model(transfer(with_one(field, value)))
    assert not reply.accepted and field in said(reply)
    assert not bench.command(Action.EXECUTE, model_sha256=reply.sha256).accepted


@pytest.mark.parametrize(
    ("field", "value"),
    [("points", 3.8e8), ("gains", 6e4), ("time_gains", 6e4), ("duration_gains", 6e4)],
)
def test_a_way_that_nobody_demonstrates_is_refused_with_its_field(field: str, value: float):
    model = planar_model()
    wild = np.full_like(getattr(model.ways[0], field), value)
    outcome = trial_of(
        replace(model, ways=(replace(model.ways[0], **{field: wild}), *model.ways[1:]))
    ).outcome()
    assert isinstance(outcome, InvalidModel) and outcome.field == f"ways.{field}"


def test_what_the_samples_teach_is_confirmed():
    assert not isinstance(trial_of(planar_model()).outcome(), InvalidModel)


@pytest.mark.parametrize("n", [3, 17, MAX_COMPONENTS])
def test_a_circle_of_components_is_executed_to_its_end(n: int):
    model = cyclic(n)
    assert not isinstance(trial_of(model).outcome(), InvalidModel)
    frames = [TaskFrame.identity(2)]
    executor = Executor(model, ExecutorSettings())
    executor.begin(model.means[0, 0], np.zeros(2), frames)
    assert np.isfinite(executor.remaining_s)
    following, seen, q = executor._tracker.successors, 0, 0
    while following[q] >= 0:
        q, seen = int(following[q]), seen + 1
        assert seen <= n
    assert model.terminal[q]


def test_more_components_than_are_executed_in_time_are_refused():
    with pytest.raises(InvalidModel, match=f"1 to {MAX_COMPONENTS} components"):
        cyclic(MAX_COMPONENTS + 1)


@settings(max_examples=60, deadline=None)
@given(
    field=st.sampled_from(["means", "start_means", "slopes", "duration_mean_s", "duration_variance_s2",
                           "elapsed_mean_s", "phase", "covariances",
                           "residual_covariances", "start_covariances"]),
    exponent=st.floats(-45.0, 38.0),
    component=st.integers(0, 7),
)  # fmt: skip
def test_of_any_size_a_number_is_refused_with_its_field_or_the_model_can_be_executed(
    field: str, exponent: float, component: int
):
    value = 10.0**exponent
    try:
        model = with_one(field, value * EYE if "covariances" in field else value, component)
        _check_numbers(model)
    except InvalidModel as error:
        assert error.field == field
    else:
        _try_out(model)


NAMES = [("hole",), ("Goal",), ("goal ",), ("target frame",)]


@pytest.mark.parametrize("names", NAMES)
def test_a_model_of_a_frame_with_another_name_is_refused_naming_both(names: tuple[str, ...]):
    outcome = trial_of(replace(planar_model(), frame_names=names)).outcome()
    assert isinstance(outcome, InvalidModel) and outcome.field == "frame_names"
    for name in (*TASK.frame_names, *names):
        assert repr(name) in str(outcome)


def test_frames_in_another_order_are_other_frames():
    two = structs.replace(TASK, frame_names=("a", "b"), landmarks={"a": TASK.target})
    turned = replace(learned(n_frames=2), frame_names=("b", "a"))
    content = encode(turned)
    sent = ModelTransfer(task=TASK.name, sha256=content_hash(content), content=content)
    reply = ModelStore(TaskSet([two])).answer(sent, Stamp("boot", 1))
    assert not reply.accepted and "'a' and 'b'" in said(reply) and "'b' and 'a'" in said(reply)


def test_only_the_newest_models_are_kept():
    store = ModelStore(TaskSet([TASK]))
    sent = [transfer(replace(planar_model(), max_distance_m=0.1 + 1e-3 * n)) for n in range(_MOST_KEPT + 3)]
    assert all(store.answer(each, Stamp("boot", 1)).accepted for each in sent)
    assert len(store.all()) == _MOST_KEPT
    assert store.get(sent[0].sha256) is None and store.newest is store.get(sent[-1].sha256)


@pytest.mark.parametrize("holder", ["session", "", "another"])
def test_while_another_site_is_in_control_no_model_of_this_one_is_taken(holder: str):
    bench = Bench()
    if holder:
        assert bench.ask_lease(session=holder, name="eve").granted
    reply = bench.send_model()
    assert reply.accepted == (holder != "another")
    if not reply.accepted:
        assert said(reply) == "eve is in control"
