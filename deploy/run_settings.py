"""Settings of `farhand up` and `farhand demo`, which the three processes share, checked before any of them starts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.common.task import AnyTask
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.pki.throw_away import Transport, transport_for
from farhand.deploy.places import find_cell, find_tasks
from farhand.deploy.site_processes import configured


@dataclass(frozen=True)
class RunSettings:
    """Settings that all three processes share.

    Args:
        task: Names or files of tasks, with commas between.
        link: Profile of the simulated link.
        seed: Seed of all random numbers.
        transport: Scheme of the endpoints; None for the one that suits the link.
        robot: Name or file of the robot; empty for the usual one.
        own_arm: Name or file of the operator's arm; empty for the usual one.
        plant: Name of an installed driver; empty for what `remote_config` says.
        arm_driver: Name of an installed driver in the same way.
        perception: Name of an installed driver in the same way.
        camera: Name of an installed camera in the same way; `none` for no camera.
        remote_config: File of the robot's site; None for none.
    """

    task: str
    link: str
    seed: int
    transport: Transport | None = None
    robot: str = ""
    own_arm: str = ""
    plant: str = ""
    arm_driver: str = ""
    perception: str = ""
    camera: str = ""
    remote_config: Path | None = None

    def check(self) -> None:
        """Refuse settings in one line before the start that would end the processes one by one.

        Raises:
            InvalidConfiguration: When there is no such task, profile or driver, or the tasks are not for the same
                robot.
            DriverFailed: When a driver cannot be imported.
        """
        tasks = find_tasks(self.task)
        if self.remote_config is not None or any(self._drivers().values()):
            self._check_drivers(tasks.first)
        for name in {self.robot, self.own_arm} - {""}:
            find_cell(tasks.first, name)
        self.rate_bps()
        if self.seed < 0:
            raise InvalidConfiguration("command line", "seed", f"zero or more, got {self.seed}")

    def _drivers(self) -> dict[str, str]:
        """Return the chosen drivers by their fields."""
        return {name: getattr(self, name) for name in ("plant", "arm_driver", "perception", "camera")}

    def driver_options(self) -> list[str]:
        """Return the chosen drivers as options of `farhand remote`."""
        return [f"--{name.replace('_', '-')}={value}" for name, value in self._drivers().items() if value]

    def _check_drivers(self, task: AnyTask) -> None:
        from farhand.remote_site.config import RemoteConfig
        from farhand.remote_site.robots.installed import check_drivers  # takes a second, and is rarely needed

        overrides = {f"{name}_use": driver or None for name, driver in self._drivers().items()}
        check_drivers(configured(RemoteConfig, self.remote_config, **overrides), task)

    @property
    def scheme(self) -> Transport:
        """Scheme of the endpoints."""
        return self.transport or transport_for(self.rate_bps())

    def rate_bps(self) -> float:
        """Return the rate of the simulated link's slower direction [bit/s]; 0: more than enough.

        Raises:
            InvalidConfiguration: When there is no such profile.
        """
        settings = find_profile(load_profiles(PROFILES_FILE), self.link).settings
        rates = [way.rate_bps for way in (settings.uplink, settings.downlink) if way.rate_bps]
        return min(rates, default=0.0)
