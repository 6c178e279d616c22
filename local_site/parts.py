"""What a console is made of, and the one picture of it all."""

from __future__ import annotations

from dataclasses import dataclass

from common.link_monitor import LinkMonitor
from common.task import AnyTask
from local_site.catalogue import Catalogue
from local_site.commanding import Commanding
from local_site.model_sender import ModelSender
from local_site.notices import Notices
from local_site.own_place import OwnPlace
from local_site.picture import Picture
from local_site.reports import Reports
from local_site.stop_sender import StopSender
from local_site.task_library import TaskLibrary
from local_site.teaching import Teaching


@dataclass(frozen=True)
class Parts:
    """Each owns some facts; nobody else keeps them. Used by the console's thread alone.

    Args:
        task: What is taught and done.
        library: Demonstrations and models.
        place: What the operator's hand moves.
        catalogue: What the robot has to fetch.
        teaching: Recording, undoing, sending by itself.
        models: What the robot has confirmed.
        commanding: The control of the robot, and what was asked of it.
        stop: The newest stop of this site.
        reports: What the robot has reported.
        monitor: How the link is doing.
        notices: What the operator should read.
    """

    task: AnyTask
    library: TaskLibrary
    place: OwnPlace
    catalogue: Catalogue
    teaching: Teaching
    models: ModelSender
    commanding: Commanding
    stop: StopSender
    reports: Reports
    monitor: LinkMonitor
    notices: Notices

    def draw(self, now_s: float) -> Picture:
        """All that is known now."""
        library, commanding, reports = self.library, self.commanding, self.reports
        return Picture(
            now_s=now_s,
            robot=reports.robot,
            link=self.monitor.view(now_s),
            in_control=commanding.in_control(reports.robot),
            why_not_in_control=commanding.why_not_in_control,
            wish=commanding.present_wish,
            asked_by=commanding.asked_by,
            pending=dict(commanding.pending),
            notices=self.notices.newest(),
            recording=library.recording,
            n_demonstrations=len(library.demonstrations),
            can_undo=library.can_undo,
            can_recover=self.teaching.left_over is not None or self.catalogue.recordings.can_recover,
            fetching=self.catalogue.recordings.fetching,
            robot_scene=self.catalogue.scene.description,
            scene_fetching=self.catalogue.scene.fetching,
            learned=library.learned,
            forming=library.forming(),
            confirmed_sha256=self.models.confirmed_sha256,
            sending_model=self.models.sending,
            auto_send=self.teaching.auto_send,
            revisions=library.revisions,
            revision=library.revision,
            strokes=library.strokes,
            stroke_frames=library.stroke_frames,
            own_frames=tuple(self.place.frames),
            own_arm=self.place.view,
            path=reports.path,
            path_received_s=reports.path_received_s,
            must_preview=self.task.require_preview,
            can_retract=self.task.retract_m is not None,
            lost_link=self.task.lost_link,
            plan_id=reports.plan_id,
            plan_received_s=reports.plan_received_s,
            stop=self.stop.status,
            command_round_trips_s=tuple(commanding.round_trips_s),
        )
