"""Effect of an impaired link on messages: each may be late, lost, duplicated, corrupted or reordered.

Losses follow a Markov chain with two states of the link, good and bad, each with its own share of losses: the
model of Gilbert and Elliott. Random loss of share P with a correlation C is such a chain as well: the bad state
loses all messages, the good one none, and the chain turns bad with P (1 - C) and good with (1 - P) (1 - C).
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from random import Random
from typing import NamedTuple

from farhand.common.impairment.delay_line import Jitter
from farhand.common.impairment.impairment import DirectionSettings


@dataclass(frozen=True)
class GilbertElliott:
    """Probabilities of the chain, in netem's letters.

    Args:
        p: Probability per message to turn from good to bad.
        r: Probability per message to turn from bad to good.
        one_minus_h: Loss while bad.
        one_minus_k: Loss while good.
    """

    p: float
    r: float
    one_minus_h: float = 1.0
    one_minus_k: float = 0.0

    @classmethod
    def of(cls, settings: DirectionSettings) -> GilbertElliott | None:
        """Make the chain of these settings; None if nothing is lost."""
        if settings.gemodel_p:
            return cls(
                settings.gemodel_p / 100,
                settings.gemodel_r / 100,
                settings.gemodel_1_h / 100,
                settings.gemodel_1_k / 100,
            )
        if settings.loss:
            loss, apart = settings.loss / 100, 1 - settings.loss_correlation / 100
            return cls(p=loss * apart, r=(1 - loss) * apart)
        return None

    @property
    def bad_share(self) -> float:
        """Long-run share of the messages that meet a bad link."""
        return self.p / (self.p + self.r)


class Loss:
    """Source of losses, message by message. The first state is drawn from the chain's long-run distribution.

    Args:
        settings: Parameters; `change` replaces them.
        random: Random generator for this purpose alone.
    """

    def __init__(self, settings: DirectionSettings, random: Random):
        self._random = random
        self._bad: bool | None = None
        self._chain = GilbertElliott.of(settings)

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters; a link that is bad stays so until it turns good."""
        self._chain = GilbertElliott.of(settings)
        if self._chain is None:
            self._bad = None

    def is_lost(self) -> bool:
        """Decide whether the next message is lost."""
        chain = self._chain
        if chain is None:
            return False
        draw = self._random.random
        if self._bad is None:
            self._bad = draw() < chain.bad_share
        elif self._bad:
            self._bad = draw() >= chain.r
        else:
            self._bad = draw() < chain.p
        return draw() < (chain.one_minus_h if self._bad else chain.one_minus_k)


class Arrival(NamedTuple):
    """Arrival of one copy of a message.

    Args:
        due_s: Time of the arrival [s].
        corrupted_at: Place of the one inverted bit, as a share of the length from 0 to below 1; None for an intact copy.
    """

    due_s: float
    corrupted_at: float | None = None

    def received(self, data: bytes) -> bytes:
        """Return the message as it arrives."""
        if self.corrupted_at is None or not data:
            return data
        byte, bit = divmod(int(self.corrupted_at * 8 * len(data)), 8)
        return data[:byte] + bytes([data[byte] ^ 1 << bit]) + data[byte + 1 :]


class MessageLine:
    """One direction of a link of messages, which draws the arrivals of each message.

    Each impairment has its own random sequence, so that a change of one leaves the others as they are. A
    message that is lost in transit has still taken its time to send.

    Args:
        settings: Parameters of the line.
        stream: Name of the line; each has its own random sequences.
    """

    def __init__(self, settings: DirectionSettings, stream: str = ""):
        self._settings = settings
        self._stream = stream
        self._sent_s = -math.inf  # time when the last bit leaves the sender
        self._under_way: list[tuple[float, int]] = []  # heap of (due, bytes)
        self._under_way_bytes = 0
        self._since_reordered = 0
        self._seed_all()

    @property
    def settings(self) -> DirectionSettings:
        """Present parameters."""
        return self._settings

    def push(self, now_s: float, n_bytes: int) -> list[Arrival]:
        """Send a message.

        Args:
            now_s: The time [s], on any clock that does not go back.
            n_bytes: Size of the message.

        Returns:
            The arrivals: none of a lost message, two of a duplicated one. With jitter or reorder a later message may
            arrive earlier.
        """
        settings = self._settings
        sending_s = 8 * n_bytes / settings.rate_bps if settings.rate_bps else 0.0
        self._sent_s = max(now_s, self._sent_s) + sending_s
        if self._loss.is_lost():
            return []
        arrivals = [Arrival(self._sent_s + self._draw_delay_s(), self._draw_corruption())]
        if settings.duplicate and self._duplicate.random() < settings.duplicate / 100:
            arrivals.append(Arrival(self._sent_s + self._jitter.draw_s(settings), self._draw_corruption()))
        self._forget_arrived(now_s)
        heapq.heappush(self._under_way, (arrivals[0].due_s, n_bytes))
        self._under_way_bytes += n_bytes
        return arrivals

    @property
    def next_arrival_s(self) -> float | None:
        """Arrival time of the next message in transit [s]; None for none."""
        return self._under_way[0][0] if self._under_way else None

    def free_bytes(self, now_s: float) -> int:
        """Return the room for bytes at that time; a sender without room has to wait or to drop."""
        self._forget_arrived(now_s)
        return max(0, self._settings.queue_limit_bytes - self._under_way_bytes)

    def clear(self) -> None:
        """Lose everything in transit, so that it no longer delays later messages."""
        self._sent_s = -math.inf
        self._under_way.clear()
        self._under_way_bytes = 0

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters for later messages; messages in transit keep their times."""
        reseed = settings.seed != self._settings.seed
        self._settings = settings
        if reseed:
            self._seed_all()
        else:
            self._loss.change(settings)

    def _seed_all(self) -> None:
        def chance(purpose: str) -> Random:
            return Random(f"{self._settings.seed}/{self._stream}/{purpose}")

        self._loss = Loss(self._settings, chance("loss"))
        self._jitter = Jitter(chance("jitter"))
        self._duplicate = chance("duplicate")
        self._reorder = chance("reorder")
        self._corrupt = chance("corrupt")

    def _forget_arrived(self, now_s: float) -> None:
        while self._under_way and self._under_way[0][0] <= now_s:
            self._under_way_bytes -= heapq.heappop(self._under_way)[1]

    def _draw_corruption(self) -> float | None:
        corrupt = self._settings.corrupt
        return self._corrupt.random() if corrupt and self._corrupt.random() < corrupt / 100 else None

    def _draw_delay_s(self) -> float:
        settings = self._settings
        if settings.reorder:
            self._since_reordered += 1
            if self._since_reordered >= settings.gap and self._reorder.random() < settings.reorder / 100:
                self._since_reordered = 0
                return 0.0
        return self._jitter.draw_s(settings)
