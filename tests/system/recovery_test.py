#!/usr/bin/python3
"""Each process of the whole line is killed in turn: the swarm recovers and nothing else dies."""
import os
import pathlib
import signal
import tempfile
import unittest

from swarm import Monitor, Swarm, wait_for, write_lab_sequence

RECOVERY_S = 90  # generous: slam may have to find its way in a new map, on a loaded machine


class Recovery(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        sequence = write_lab_sequence(pathlib.Path(cls.folder.name) / "lab")
        cls.swarm = Swarm(f"""
  slam: {{}}
  carver: {{}}
  mesher: {{}}
  link: {{params: {{to_operator_delay_s: 0.1, to_robot_delay_s: 0.1}}}}
  renderer: {{site: operator, params: {{display: headless, picture_width_px: 160, idle_rate_hz: 2}}}}
  camera: {{start: last, params: {{source: {sequence}, loop: true}}}}
""")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.addClassCleanup(cls.swarm.close)
        cls.swarm.up()
        cls.monitor = Monitor()
        cls.addClassCleanup(cls.monitor.close)

    def wait(self, condition, what):
        wait_for(condition, RECOVERY_S,
                 lambda: f"{what}: {self.monitor.summary()}{self.swarm.logs()}")

    def messages(self, name, channel, domain="robot"):
        return self.monitor.port(name, channel, "in", domain)["messages"]

    def wait_until_all_work(self):
        self.wait(lambda: self.monitor.state("slam") == "OK", "slam tracks")
        self.wait(lambda: self.monitor.state("renderer") == "OK", "the renderer shows a prediction")
        self.wait(lambda: all(self.monitor.state(n) == "OK" for n in ("carver", "mesher", "link")),
                  "all are well")

    def kill(self, name, *streams):
        """SIGKILL; waits for the successor's report and checks that nobody else was replaced and
        that the streams, as (receiver, channel, domain), bring their receivers something new."""
        self.wait_until_all_work()
        before = self.swarm.pids()
        marks = {stream: 0 if stream[0] == name else self.messages(*stream) for stream in streams}
        os.kill(before[name], signal.SIGKILL)
        self.wait(lambda: (self.monitor.process(name) or {"pid": before[name]})["pid"]
                  not in (before[name], 0), f"a new {name} reports")
        for stream, mark in marks.items():
            self.wait(lambda stream=stream, mark=mark: self.messages(*stream) > mark,
                      f"{stream[1]} reaches {stream[0]}")
        self.wait_until_all_work()
        after = self.swarm.pids()
        self.assertNotEqual(after.pop(name), before.pop(name))
        self.assertEqual(after, before, f"somebody else died when {name} was killed")

    def test_camera(self):
        self.kill("camera", ("slam", "IMAGE", "robot"))

    def test_slam_begins_a_new_map_that_all_follow(self):
        self.kill("slam", ("carver", "MAP_DELTA", "robot"), ("mesher", "CARVING_DELTA", "robot"),
                  ("renderer", "MESH", "operator"), ("renderer", "VIEW", "operator"))

    def test_carver_is_given_the_whole_map(self):
        self.kill("carver", ("carver", "MAP_DELTA", "robot"), ("mesher", "CARVING_DELTA", "robot"),
                  ("renderer", "MESH", "operator"))

    def test_mesher_is_given_the_whole_carving(self):
        self.kill("mesher", ("mesher", "CARVING_DELTA", "robot"), ("renderer", "MESH", "operator"))

    def test_link(self):
        self.kill("link", ("renderer", "VIEW", "operator"))

    def test_renderer_is_given_the_mesh(self):
        self.kill("renderer", ("renderer", "MESH", "operator"), ("renderer", "VIEW", "operator"))


if __name__ == "__main__":
    unittest.main()
