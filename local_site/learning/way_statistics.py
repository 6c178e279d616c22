"""Sufficient statistics of a way: Algorithm 1's count form at the phases of whole motions.

No demonstration is kept, and the size of the statistics does not depend on their number.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.manifold import Manifold
from farhand.common.model.way import N_COARSE, N_PHASES

Array = NDArray[np.float64]

COARSE = np.arange(0, N_PHASES + 1, N_PHASES // N_COARSE)
"""Phases at which scatters are kept."""


@dataclass(frozen=True, eq=False)
class WholeMotion:
    """Demonstration at equal phases.

    Args:
        points: Points relative to each frame. Shape (P, N + 1, C).
        time_shares: Elapsed share of the time at each phase. Shape (N + 1,).
        duration_s: Duration [s].
        terminal: Terminal component.
    """

    points: Array
    time_shares: Array
    duration_s: float
    terminal: int


@dataclass(frozen=True, eq=False)
class WayStatistics:
    """Sufficient statistics of similar demonstrations, in count form.

    Args:
        n: Number of demonstrations.
        ends: Pairs of a terminal component and the number of demonstrations that ended in it. Shape (m, 2).
        points: Mean points. Shape (P, N + 1, C).
        time_shares: Mean time shares. Shape (N + 1,).
        log_duration: Mean of the duration's logarithm.
        S: Scatter of the starts. Shape (P, T, T).
        C: Scatter of the points with the starts, at the coarse phases. Shape (P, M + 1, T, T).
        V: Scatter of the points. Shape (P, M + 1, T, T).
        c: Scatter of the time shares with the starts, seen from the goal. Shape (M + 1, T).
        d: Scatter of the duration's logarithm with the starts, seen from the goal. Shape (T,).
    """

    n: int
    ends: NDArray[np.int64]
    points: Array
    time_shares: Array
    log_duration: float
    S: Array
    C: Array
    V: Array
    c: Array
    d: Array

    @classmethod
    def of(cls, motion: WholeMotion, space: Manifold) -> WayStatistics:
        """Return the statistics of a single demonstration."""
        P, T, M = len(motion.points), space.n_tangent, N_COARSE + 1
        zeros = np.zeros
        return cls(
            n=1,
            ends=np.array([[motion.terminal, 1]]),
            points=motion.points,
            time_shares=motion.time_shares,
            log_duration=float(np.log(motion.duration_s)),
            S=zeros((P, T, T)),
            C=zeros((P, M, T, T)),
            V=zeros((P, M, T, T)),
            c=zeros((M, T)),
            d=zeros(T),
        )

    def merged(self, other: WayStatistics, space: Manifold) -> WayStatistics:
        """Return the exact statistics of both ways' demonstrations (parallel axes theorem).

        With a single demonstration in `other` this is the online update. Rotations are carried to the tangent space of the common mean (parallel transport by half the step).
        """
        n = self.n + other.n
        e = space.log(self.points, other.points)
        x, s = e[:, COARSE], e[:, 0]
        tau, longer = (other.time_shares - self.time_shares), other.log_duration - self.log_duration
        ours, theirs = self._carried(other.n / n * e, space), other._carried(-self.n / n * e, space)
        r = self.n * other.n / n
        ends = dict(self.ends.tolist())
        for terminal, count in other.ends.tolist():
            ends[terminal] = ends.get(terminal, 0) + count
        return WayStatistics(
            n=n,
            ends=np.array(sorted(ends.items())),
            points=space.exp(self.points, other.n / n * e),
            time_shares=self.time_shares + other.n / n * tau,
            log_duration=self.log_duration + other.n / n * longer,
            S=ours.S + theirs.S + r * np.einsum("pt,pu->ptu", s, s),
            C=ours.C + theirs.C + r * np.einsum("pkt,pu->pktu", x, s),
            V=ours.V + theirs.V + r * np.einsum("pkt,pku->pktu", x, x),
            c=ours.c + theirs.c + r * tau[COARSE][:, None] * s[-1],
            d=ours.d + theirs.d + r * longer * s[-1],
        )

    def _carried(self, step: Array, space: Manifold) -> WayStatistics:
        """Return the statistics with scatters in the tangent spaces of means moved by a step (P, N + 1, T)."""
        if not space.oriented or self.n == 1:
            return self
        back = np.broadcast_to(np.eye(6), (*step.shape[:2], 6, 6)).copy()
        turns = Rotation.from_rotvec(-0.5 * step[..., 3:].reshape(-1, 3)).as_matrix()
        back[..., 3:, 3:] = turns.reshape(*step.shape[:2], 3, 3)
        x, s = back[:, COARSE], back[:, 0]
        return replace(
            self,
            S=np.einsum("ptu,puv,pwv->ptw", s, self.S, s),
            C=np.einsum("pktu,pkuv,pwv->pktw", x, self.C, s),
            V=np.einsum("pktu,pkuv,pkwv->pktw", x, self.V, x),
            c=self.c @ s[-1].T,
            d=s[-1] @ self.d,
        )
