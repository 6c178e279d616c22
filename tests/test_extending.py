"""The page about a robot of one's own: its example executes a model."""

import re
import shutil
from pathlib import Path

import msgspec
import numpy as np

from farhand.common.arm.cell import Cell
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.robot_file import load_robot
from farhand.common.arm.robot_model import arm_spec
from farhand.deploy.places import find_point_task, find_robot
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.plant import Plant
from farhand.remote_site.reproduction.executor import Executor
from farhand.remote_site.robots.point_embodiment import point_embodiment

PAGE = (Path(__file__).parent.parent / "docs" / "extending.md").read_text(encoding="utf-8")
DT_S = 0.02
(TABLES,) = re.findall(r"```toml\n(task = .*?)```", PAGE, re.DOTALL)
SITE = msgspec.toml.decode(TABLES, type=RemoteConfig)


def test_the_file_of_the_site_chooses_the_drivers_that_the_package_brings():
    assert (SITE.plant.use, SITE.perception.use) == ("my-table", "my-camera")
    for driver in (SITE.plant, SITE.perception):
        assert f"\n{driver.use} = " in PAGE and driver.options


def test_the_file_of_an_arm_fits_the_urdf_that_it_is_for(tmp_path: Path):
    (text,) = re.findall(r"```toml\n(schema = 1.*?)```", PAGE, re.DOTALL)
    robots = find_robot("panda-urdf").path("model").parent
    shutil.copy(robots / "panda.urdf", tmp_path / "arm.urdf")
    shutil.copytree(robots / "meshes", tmp_path / "meshes")
    (tmp_path / "arm.toml").write_text(text)
    robot = load_robot(tmp_path / "arm.toml")
    arm_spec(robot)
    tip = Kinematics(Cell(robot=robot)).tip
    assert np.all(np.array(robot.workplace.low_m)[1:] < tip[1:3]) and np.all(tip[:3] < 0.8)


def example() -> Embodiment:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, type] = {}
    exec(code, names)
    task, options = find_point_task("planar"), SITE
    plant = names["Table"](task, options.plant.options)
    return point_embodiment(task, plant, names["Camera"](task, options.perception.options))


def test_the_plant_and_the_sight_execute_what_was_learned():
    robot = example()
    learner = OnlineLearner(LearnerSettings(0.22), 2, ("u",))
    for stroke in sample_strokes(find_point_task("planar")):
        learner.start()
        learner.observe_many(stroke.position_m, stroke.frames_at(0), stroke.time_s)
        learner.end()
    executor = Executor(learner.model(), robot.hardware.settings)
    frames = robot.hardware.perception.observe(0.0)
    assert frames is not None
    state = robot.hardware.plant.read()
    executor.begin(state.point, state.velocity, frames)
    for _ in range(1000):
        state = robot.hardware.plant.read()
        control = executor.step(state.point, state.velocity, frames)
        if control.arrived:
            break
        robot.hardware.plant.accelerate(control.acceleration, DT_S)
    assert np.linalg.norm(robot.hardware.plant.read().position_m - frames[0].b) < 0.01


def test_the_plant_is_driven_and_brakes_to_rest():
    plant: Plant = example().hardware.plant
    for _ in range(300):
        plant.follow(np.array([0.5, 0.5]), 0.6, DT_S)
    np.testing.assert_allclose(plant.read().position_m, [0.5, 0.5], atol=1e-3)
    for _ in range(20):
        plant.accelerate(np.array([4.0, 0.0]), DT_S)
    for _ in range(60):
        plant.brake(DT_S)
    np.testing.assert_array_equal(plant.read().velocity_m_s, 0.0)
