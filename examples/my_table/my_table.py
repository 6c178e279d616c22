"""A table of two axes that is told velocities, and a camera that sees where its work lies."""

import numpy as np

from farhand import EffectorState, TaskFrame


class Table:
    fault = ""  # what the drives report: read in every control period, empty while all is well

    def __init__(self, task, options):
        self.limits, self.gain = task.limits, options.get("gain_1_s", 5.0)
        self.position_m, self.velocity_m_s = np.array(task.start_m), np.zeros(task.n_dims)

    def read(self):
        return EffectorState(self.position_m.copy(), self.velocity_m_s.copy())

    def accelerate(self, acceleration, dt_s):
        self.go(self.velocity_m_s + acceleration * dt_s, self.limits.speed_m_s, dt_s)

    def follow(self, point, max_speed_m_s, dt_s):
        self.go(self.gain * (point - self.position_m), max_speed_m_s, dt_s)

    def brake(self, dt_s):
        self.go(np.zeros_like(self.velocity_m_s), 0.0, dt_s)

    def halt(self):
        self.velocity_m_s = np.zeros_like(self.velocity_m_s)  # a machine: cut the drives' enable

    def go(self, wanted_m_s, max_speed_m_s, dt_s):
        wanted_m_s = wanted_m_s * min(1.0, max_speed_m_s / max(np.linalg.norm(wanted_m_s), 1e-9))
        change, most = wanted_m_s - self.velocity_m_s, self.limits.acceleration_m_s2 * dt_s
        self.velocity_m_s = self.velocity_m_s + change * min(1.0, most / max(np.linalg.norm(change), 1e-9))
        self.position_m = self.position_m + self.velocity_m_s * dt_s  # a machine: tell the drives


class Camera:
    def __init__(self, task, options):
        self.origin_m = np.array(options.get("origin_m", task.target.origin_m))

    def observe(self, now_s):
        return [TaskFrame(np.eye(self.origin_m.size), self.origin_m)]
