#!/usr/bin/python3
"""Each process of the line on video is killed in turn: the swarm recovers and nothing else dies."""
import pathlib
import tempfile
import unittest

from recovery import RecoveryCase
from swarm import write_lab_sequence


class Recovery(RecoveryCase):
    WELL = ("carver", "mesher", "link")

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        sequence = write_lab_sequence(pathlib.Path(folder.name) / "lab")
        cls.deploy(f"""
  slam: {{}}
  carver: {{}}
  mesher: {{}}
  link: {{params: {{to_operator_delay_s: 0.1, to_robot_delay_s: 0.1}}}}
  renderer: {{site: operator, params: {{display: headless, picture_width_px: 160, idle_rate_hz: 2}}}}
  camera: {{start: last, params: {{source: {sequence}, loop: true}}}}
""")

    def test_camera(self):
        self.kill("camera", ("slam", "IMAGE", "robot"))

    def test_slam_goes_on_in_its_map_and_all_are_given_it(self):
        self.kill("slam", ("carver", "MAP_DELTA", "robot"), ("mesher", "CARVING_DELTA", "robot"),
                  ("renderer", "MESH", "operator"), ("renderer", "VIEW", "operator"))

    def test_slam_keeps_its_map_while_stopped(self):
        self.wait_until_all_work()
        restarts = self.metric("slam", "restarts")
        self.stop_for("slam", 2, "IMAGE")
        self.assertEqual(self.metric("slam", "restarts"), restarts)

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
