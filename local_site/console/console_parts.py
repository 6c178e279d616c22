"""Parts of a console, and the one picture of them all."""

from __future__ import annotations

from dataclasses import dataclass

from farhand.local_site.console.catalogue import RobotCatalogue
from farhand.local_site.console.commanding import Commanding
from farhand.local_site.console.console_state import ConsoleState, TaskStanding
from farhand.local_site.console.executions import ExecutionHistory
from farhand.local_site.console.sending import Sending
from farhand.local_site.console.teaching import Teaching
from farhand.local_site.exchange.camera import CameraWatch
from farhand.local_site.exchange.model_sender import ModelSender
from farhand.local_site.exchange.notices import Notices
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.reports import Reports
from farhand.local_site.exchange.stop_sender import StopLane
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.workcell import Workcell


@dataclass(frozen=True)
class ConsoleParts:
    """Parts of a console, each the only owner of its facts. Used by the console's thread alone.

    Args:
        library: Demonstrations and models.
        place: Workcell.
        catalogue: Recordings and drawing of the robot.
        teaching: Recording and undoing.
        sending: Models that the operator wants sent.
        models: Models that the robot has confirmed.
        commanding: Control of the robot, and pending commands.
        stop: Newest stop of this site.
        reports: Newest reports of the robot.
        executions: Executions that the robot has told of.
        camera: Pictures of the robot's camera.
        monitor: State of the link.
        notices: Messages for the operator.
    """

    library: Library
    place: Workcell
    catalogue: RobotCatalogue
    teaching: Teaching
    sending: Sending
    models: ModelSender
    commanding: Commanding
    stop: StopLane
    reports: Reports
    executions: ExecutionHistory
    camera: CameraWatch
    monitor: LinkMonitor
    notices: Notices

    def draw(self, now_s: float) -> ConsoleState:
        """Return the complete present state."""
        task, library = self.library.task, self.library.chosen
        commanding, reports = self.commanding, self.reports
        return ConsoleState(
            now_s=now_s,
            robot=reports.robot,
            robot_version=self.catalogue.robot_version,
            robot_tasks=commanding.robot_tasks,
            other_schema=reports.other_schema,
            link=self.monitor.view(now_s),
            in_control=commanding.in_control(reports.robot),
            why_not_in_control=commanding.why_not_in_control,
            wish=commanding.present_wish,
            asked_by=commanding.asked_by,
            pending=dict(commanding.pending),
            notices=self.notices.newest(),
            task=task,
            tasks=tuple(map(self._standing, self.library.by_task)),
            sending_library=self.sending.sending_library,
            recording=library.recording,
            demonstrations=library.demonstrations,
            demonstration_names=library.demonstration_names,
            can_undo=library.can_undo,
            can_recover=self.teaching.left_over is not None or self.catalogue.recordings.can_recover,
            fetching=self.catalogue.recordings.fetching,
            robot_scene=self.catalogue.scene.description,
            scene_fetching=self.catalogue.scene.fetching,
            learned=library.learned,
            forming=library.forming(),
            confirmed_sha256=self.models.confirmed_sha256(task.name),
            robot_model=self.models.confirmed(task.name),
            miss=self.teaching.miss,
            auto_send=self.sending.by_itself,
            revisions=library.revisions,
            revision=library.revision,
            strokes=library.strokes,
            stroke_frames=library.stroke_frames,
            own_frames=tuple(self.place.frames),
            own_arm=self.place.view,
            executions=self.executions.known,
            camera=self.camera.state,
            path=reports.path,
            path_received_s=reports.path_received_s,
            plan_id=reports.plan_id,
            plan_received_s=reports.plan_received_s,
            stop=self.stop.status,
            command_round_trips_s=tuple(commanding.round_trips_s),
        )

    def _standing(self, name: str) -> TaskStanding:
        taught = self.library.by_task[name]
        learned = taught.learned
        return TaskStanding(
            name=name,
            n_demonstrations=len(taught.demonstrations),
            learned_sha256=learned.sha256 if learned is not None else "",
            model_bytes=len(learned.content) if learned is not None else 0,
            confirmed_sha256=self.models.confirmed_sha256(name),
            sending_sha256=self.models.sending_sha256(name),
            asking=self.models.asking(name),
            robot_does=self.sending.robot_does(name),
        )
