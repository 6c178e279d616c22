"""Control: the MPC beside its peers, the forward variable, the whole tick, and its memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.learning import FRAMES, SPACES, path_with, taught
from benchmarks.mpc_peers import BandedMpc, DenseMpc, OsqpMpc, SemiImplicitMpc
from benchmarks.timing import BenchmarkRow, best_times_us
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.forward_variable import duration_probabilities, forward_variable
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.mpc import solve

Array = NDArray[np.float64]

DT, CONTROL_COST = 0.02, 1e-3
_N_TICKS, _N_TICKS_BEFORE = 1_000_000, 50_000


def rows() -> list[BenchmarkRow]:
    """Time everything about control."""
    found = []
    for name, space in SPACES.items():
        for n_steps in (20, 50, 100, 200):
            found += _mpc(name, space.n_tangent, n_steps)
    models = {name: taught(space, path_with(space, 14)).model() for name, space in SPACES.items()}
    found += _forward(models["D = 3"])
    for name, model in models.items():
        found += _ticks(name, model)
    return found


def memory_growth_bytes() -> int:
    """Return the resident memory after 1,000,000 ticks less that after 50,000 [bytes]."""
    space = Manifold(3)
    path = path_with(space, 14)
    executor, frames = Executor(taught(space, path).model(), ExecutorSettings()), _moving_frames()
    position, still, before = path[0], np.zeros(3), 0
    executor.begin(position, still, FRAMES)
    for n in range(_N_TICKS):
        if n == _N_TICKS_BEFORE:
            before = _resident_bytes()
        executor.step(path[n // 10 % len(path)], still, frames[n % len(frames)])
    return _resident_bytes() - before


def _mpc(name: str, D: int, n_steps: int) -> list[BenchmarkRow]:
    random = np.random.default_rng(0)
    roots = random.normal(size=(n_steps, D, D))
    Q = roots @ roots.transpose(0, 2, 1) + np.eye(D)
    targets = np.cumsum(0.01 * random.normal(size=(n_steps, D)), axis=0)
    p, v = 0.1 * random.normal(size=(2, D))
    ours, shape = (CONTROL_COST,) * D, (n_steps, D, CONTROL_COST, DT)
    peers = {
        "dense Eq. 7": DenseMpc(*shape),
        "banded (`solve_banded`)": BandedMpc(*shape),
        "banded (`solveh_banded`), semi-implicit hold": SemiImplicitMpc(*shape),
        "OSQP, 1e-6": OsqpMpc(*shape, Q),
    }
    u = solve(p, v, targets, Q, ours, n_steps, DT)
    np.testing.assert_allclose(peers["dense Eq. 7"].solve(p, v, targets, Q), u, atol=1e-9)
    np.testing.assert_allclose(peers["banded (`solve_banded`)"].solve(p, v, targets, Q), u, atol=1e-9)
    np.testing.assert_allclose(peers["OSQP, 1e-6"].solve(p, v, targets, Q), u, atol=1e-3)
    functions = {peer: (lambda m=mpc: m.solve(p, v, targets, Q)) for peer, mpc in peers.items()}
    best = best_times_us({"ours": lambda: solve(p, v, targets, Q, ours, n_steps, DT), **functions})
    targets_of = {}
    if n_steps == 100:
        limit = "<= 20 us" if D == 3 else "<= 250 us"
        targets_of = {"dense Eq. 7": f"{limit}, >= 100x", "banded (`solve_banded`)": ">= 5x"}
    what = f"MPC, {name}, N_p = {n_steps}"
    return [BenchmarkRow(what, best["ours"], peer, best[peer], targets_of.get(peer, "")) for peer in peers]


def _forward(model: TPHSMM) -> list[BenchmarkRow]:
    first, n_steps = int(np.argmax(model.initial)), 100
    ours = forward_variable(model, first, 0.0, n_steps, DT)
    for peer in (naive, vectorised):
        np.testing.assert_allclose(peer(model, first, n_steps, DT), ours, atol=1e-12)
    best = best_times_us(
        {
            "ours": lambda: forward_variable(model, first, 0.0, n_steps, DT),
            "naive": lambda: naive(model, first, n_steps, DT),
            "vectorised": lambda: vectorised(model, first, n_steps, DT),
        }
    )
    what = f"forward variable, K = {model.n_components}, {n_steps} steps"
    return [
        BenchmarkRow(what, best["ours"], "vectorised numpy", best["vectorised"], ">= 10x"),
        BenchmarkRow(what, best["ours"], "naive recursion", best["naive"]),
    ]


def _ticks(name: str, model: TPHSMM) -> list[BenchmarkRow]:
    space, n_steps = model.manifold, 100
    executor, still = (
        Executor(model, ExecutorSettings(dt_s=DT, horizon_s=n_steps * DT)),
        np.zeros(model.manifold.n_tangent),
    )
    first = int(np.argmax(model.initial))
    point, frames, n = model.start_means[0, first], _moving_frames(), [0]
    executor.begin(point, still, FRAMES)

    def moving() -> None:
        n[0] += 1
        executor.step(point, still, frames[n[0] % len(frames)])

    T = space.n_tangent
    Q = np.broadcast_to(np.eye(T), (n_steps, T, T)).copy()
    best = best_times_us(
        {
            "still": lambda: executor.step(point, still, FRAMES),
            "moving": moving,
            "solve": lambda: solve(still, still, np.zeros((n_steps, T)), Q, (1.0,) * T, n_steps, DT),
        }
    )
    begin = best_times_us({"begin": lambda: executor.begin(point, still, FRAMES)})["begin"]
    what = f"whole tick, {name}, N_p = {n_steps}"
    return [
        BenchmarkRow(f"beginning an execution, {name}", begin),
        *(
            BenchmarkRow(f"{what}, {case} frame", best[case], "its solve", best["solve"], "<= 10 solves")
            for case in ("still", "moving")
        ),
    ]


def _moving_frames() -> list[list[TaskFrame]]:
    angle = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    return [[TaskFrame(np.eye(3), np.array([0.05 * np.sin(a), 0.0, 0.0]))] for a in angle]


def _resident_bytes() -> int:
    fields = Path("/proc/self/statm").read_text().split()
    return int(fields[1]) * 4096


def naive(model: TPHSMM, component: int, n_steps: int, dt: float) -> Array:
    """Compute the forward variable by three nested loops over time, component and duration, from the entry of a component."""
    p = duration_probabilities(model, dt)
    K, d_max = p.shape
    survival = 1.0 - np.cumsum(p, axis=1)
    entered, alpha, ended = np.zeros((n_steps + 1, K)), np.zeros((n_steps, K)), np.zeros(K)
    entered[0, component] = 1.0
    for t in range(1, n_steps + 1):
        for i in np.flatnonzero(~model.terminal):
            stays = leaves = 0.0
            for d in range(1, min(t, d_max) + 1):
                stays += entered[t - d, i] * survival[i, d - 1]
                leaves += entered[t - d, i] * p[i, d - 1]
            alpha[t - 1, i] += stays
            ended[i] += leaves * model.exit[i]
            for j in range(K):
                entered[t, j] += leaves * model.transition[i, j]
        ended[model.terminal] += entered[t, model.terminal]
        alpha[t - 1] += np.where(model.terminal, 0.0, entered[t]) + ended
    return alpha


def vectorised(model: TPHSMM, component: int, n_steps: int, dt: float) -> Array:
    """Compute the forward variable by whole-array operations over components and durations."""
    p = duration_probabilities(model, dt)
    K, d_max = p.shape
    p = np.where(model.terminal[:, None], 0.0, p)
    survival = np.where(model.terminal[:, None], 0.0, 1.0 - np.cumsum(p, axis=1))
    backwards, stay_backwards = p[:, ::-1].T.copy(), survival[:, ::-1].T.copy()
    entered, alpha, ended = np.zeros((n_steps + d_max, K)), np.zeros((n_steps, K)), np.zeros(K)
    entered[d_max - 1, component] = 1.0
    for t in range(n_steps):
        window = entered[t : t + d_max]
        leaves = (window * backwards).sum(axis=0)
        now = leaves @ model.transition
        entered[t + d_max] = now
        ended += leaves * model.exit + np.where(model.terminal, now, 0.0)
        alpha[t] = (window * stay_backwards).sum(axis=0) + np.where(model.terminal, 0.0, now) + ended
    return alpha
