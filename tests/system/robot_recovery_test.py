#!/usr/bin/python3
"""The complete system with the simulated robot, deployed on the simulated world's clock: it works,
its processes are killed in turn, it recovers and nothing else dies."""
import os
import signal
import unittest

from recovery import RecoveryCase
from swarm import ROBOT_URL, build_dir, run


class RobotRecovery(RecoveryCase):
    WELL = ("carver", "mesher", "link", "calibrator", "wam_controller", "omni", "sim")

    @classmethod
    def setUpClass(cls):
        cls.deploy("""
  slam: {}
  carver: {}
  mesher: {}
  calibrator: {}
  wam_controller: {}
  link: {params: {to_operator_delay_s: 0.1, to_robot_delay_s: 0.1}}
  renderer:
    site: operator
    params: {display: headless, picture_width_px: 160, idle_rate_hz: 2, predict: robot}
  omni: {site: operator}
  sim:
    clock: wall
    start: last
    params: {clock: own, camera_width_px: 320, camera_rate_hz: 10}
""", clock="published")

    def test_without_its_controller_the_arm_waits_for_a_person(self):
        """The safety board misses the heartbeat: software alone cannot move the arm again. The
        controller hangs first: one that is killed may be replaced within the heartbeat, which is
        counted by the world's clock, and this world waits for its controller."""
        self.wait_until_all_work()
        before = self.swarm.pids()
        os.kill(before["wam_controller"], signal.SIGSTOP)
        self.wait(lambda: self.monitor.state("sim") == "DEGRADED", "the safety board says so")
        os.kill(before["wam_controller"], signal.SIGKILL)
        self.wait(lambda: (self.monitor.process("wam_controller") or {"pid": 0})["pid"]
                  not in (before["wam_controller"], 0), "a new controller reports")
        pressed = run(build_dir() / "bin" / "sim-pendant", "activate", "--robot-url", ROBOT_URL)
        self.assertEqual(pressed.returncode, 0, pressed.stderr)
        self.wait_until_all_work()
        after = self.swarm.pids()
        del before["wam_controller"], after["wam_controller"]
        self.assertEqual(after, before, "somebody else died")

    def test_calibrator_goes_on_in_its_alignment(self):
        self.wait_until_all_work()
        self.wait(lambda: list((self.swarm.folder / "foresight" / "kept").glob("kept_calibrator.*")),
                  "the alignment is kept")
        self.kill("calibrator", ("renderer", "BASE_POSE", "operator"))
        log = (self.swarm.run_dir / "logs" / "calibrator.log").read_text(encoding="utf-8")
        self.assertIn("alignment of before the restart is confirmed", log)

    def test_omni(self):
        self.kill("omni", ("renderer", "JOINT_COMMAND", "operator"),
                  ("wam_controller", "JOINT_COMMAND", "robot"))

    def test_sim_is_another_world_in_which_all_begin_anew(self):
        self.kill("sim", ("slam", "IMAGE", "robot"), ("wam_controller", "ARM_ENCODERS", "robot"))


if __name__ == "__main__":
    unittest.main()
