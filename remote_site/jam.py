"""Whether a plug is jammed: it presses, is not where it should be, and gets no further."""

from __future__ import annotations

from collections import deque

# Less progress than this within so long a time, under more force than this, is none.
_PROGRESS_M, _WITHIN_S, _FORCE_N = 0.0015, 1.0, 15.0


class JamDetector:
    """Watches the depth and the force.

    Args:
        from_m: Less deep than this the plug touches nothing [m].
        to_m: From here on it is in [m].
    """

    def __init__(self, from_m: float = -0.020, to_m: float = 0.070):
        self._from_m, self._to_m = from_m, to_m
        self._depths_m: deque[tuple[float, float]] = deque()

    def jammed(self, depth_m: float, force_n: float, now_s: float) -> bool:
        """Whether the plug has been jammed for a second; begins anew when it was.

        Args:
            depth_m: Of the tip behind the mouth [m].
            force_n: On the plug [N].
            now_s: Now [s].
        """
        if not self._from_m < depth_m < self._to_m or force_n < _FORCE_N:
            self._depths_m.clear()
            return False
        self._depths_m.append((now_s, depth_m))
        if now_s - self._depths_m[0][0] < _WITHIN_S:
            return False
        _, before_m = self._depths_m.popleft()
        if depth_m - before_m >= _PROGRESS_M:
            return False
        self._depths_m.clear()
        return True
