"""Random loss, alone or in bursts: the model of Gilbert and Elliott.

Losses follow a Markov chain with two states of the link, good and bad, each with its own share of losses. Random
loss of share P with a correlation C is such a chain as well: the bad state loses all messages, the good one none,
and the chain turns bad with P (1 - C) and good with (1 - P) (1 - C).
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

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
