"""Queues of messages that wait for the next control period; no sender can take another one's place."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.event_loop import Mailbox
from farhand.common.wire.messages import (
    Command,
    Heartbeat,
    LeaseRequest,
    Message,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    Stop,
)
from farhand.remote_site.supervision.lease import Lease

Job = Callable[[], None]

_MOST_WAITING, _CROWDED = 256, 64
_MOST_PER_TICK, _MOST_OTHERS_PER_TICK, _MOST_MODELS_PER_TICK = 64, 16, 1


class Inbox:
    """Queues for the robot's own workers, for stops, for the holder of the lease, and for all others.

    The holder is told from others by ids that strangers never hear, see `endpoint.py`. Any thread may put, the
    control loop alone takes. Without room the oldest is dropped: its sender repeats it.

    Args:
        lease: Lease, with the session and the id of its holder.
    """

    def __init__(self, lease: Lease):
        self._lease = lease
        self._own: Mailbox[Job] = Mailbox(_MOST_WAITING)
        self._noted: Mailbox[Job] = Mailbox()
        self._stops: Mailbox[Job] = Mailbox(_MOST_WAITING)
        self._holders: Mailbox[Job] = Mailbox(_MOST_WAITING)
        self._others: Mailbox[Job] = Mailbox(_MOST_WAITING)
        self._models: Mailbox[Job] = Mailbox(_CROWDED)
        self._other_models: Mailbox[Job] = Mailbox(_CROWDED)

    def __len__(self) -> int:
        boxes = (self._own, self._stops, self._holders, self._others, self._models, self._other_models)
        return sum(map(len, boxes))

    def put_own(self, job: Job) -> None:
        """Add a job of the robot's own workers."""
        self._own.put(job)

    def note(self, job: Job) -> None:
        """Add a note; a newer one replaces it."""
        self._noted.put(job)

    def put(self, message: Message, job: Job) -> bool:
        """Add the job of a message.

        Returns:
            False if its queue is so full that its sender must slow down.
        """
        box = self._place(message)
        box.put(job)
        return len(box) <= (_CROWDED if box is not self._other_models else 1)

    def take(self) -> list[Job]:
        """Return the jobs that a control period has time for; the rest waits for the next one."""
        models = self._models if len(self._models) else self._other_models
        return [
            *self._own.take_all(),
            *self._stops.take_all(_MOST_PER_TICK),
            *self._holders.take_all(_MOST_PER_TICK),
            *self._others.take_all(_MOST_OTHERS_PER_TICK),
            *models.take_all(_MOST_MODELS_PER_TICK),
            *self._noted.take_all(),
        ]

    def _place(self, message: Message) -> Mailbox[Job]:
        match message:
            case Stop():
                return self._stops
            case ModelTransfer(session=session):
                return self._models if self._is_holder(session) else self._other_models
            case (
                Command(lease_id=lease_id) | OperatorInput(lease_id=lease_id) | MoveTarget(lease_id=lease_id)
            ):
                return self._holders if lease_id and lease_id == self._lease.lease_id else self._others
            case Heartbeat(session=session) | LeaseRequest(session=session):
                return self._holders if self._is_holder(session) else self._others
            case _:
                return self._others

    def _is_holder(self, session: str) -> bool:
        return bool(session) and session == self._lease.session
