#!/usr/bin/python3
"""The map of a deployed slam: ordered from either site, answered, and kept across a SIGKILL."""
import os
import pathlib
import signal
import struct
import subprocess
import tempfile
import unittest

from recovery import RecoveryCase
from swarm import OPERATOR_URL, ROBOT_URL, build_dir, run, wait_for, write_lab_sequence

NOBODY = "udpm://239.255.76.69:7699?ttl=0"
TRACKING = 1


def poses(path):
    """[(arrival in µs, epoch, state)] of every CAMERA_POSE in a log."""
    data, found, at = pathlib.Path(path).read_bytes(), [], 0
    while at + 28 <= len(data):
        _, _, arrival, channel_size, size = struct.unpack_from(">IqqII", data, at)
        at += 28 + channel_size
        if at + size > len(data):
            break
        found.append((arrival, *struct.unpack_from(">qb", data, at + 16)))
        at += size
    return found


class SlamMap(RecoveryCase):
    WELL = ("carver", "link")

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.root = cls.folder / "maps"
        sequence = write_lab_sequence(cls.folder / "lab")
        cls.deploy(f"""
  slam: {{params: {{map_root: {cls.root}, keep_map_every_s: 1}}}}
  carver: {{}}
  link:
    params:
      to_operator_channels: SLAM_ANSWER
      to_robot_channels: SLAM_COMMAND
      to_operator_delay_s: 0.3
  camera: {{start: last, params: {{source: {sequence}, loop: true}}}}
""")

    def wait_until_all_work(self):
        self.wait(lambda: self.monitor.state("slam") == "OK", "slam tracks")

    def order(self, *words, robot=ROBOT_URL, operator=OPERATOR_URL):
        return run(build_dir() / "bin" / "slam-map", *words, "--robot-url", robot,
                   "--operator-url", operator)

    def test_orders_from_either_site_are_answered(self):
        self.wait_until_all_work()
        for name, urls in (("here", {"operator": NOBODY}), ("there", {"robot": NOBODY}),
                           ("both", {})):
            saved = self.order("save", name, **urls)
            self.assertEqual(saved.returncode, 0, saved.stderr)
            self.assertIn(f"in {self.root}/{name}", saved.stdout)
            self.assertTrue((self.root / name / "points3D.txt").exists())
        loaded = self.order("load", "there", robot=NOBODY)
        self.assertEqual(loaded.returncode, 0, loaded.stderr)
        reset = self.order("reset")
        self.assertEqual((reset.returncode, reset.stdout), (0, "slam-map: the map is forgotten\n"))

    def test_what_is_not_done_is_an_error(self):
        self.wait_until_all_work()
        for words, code, line in ((("load", "nothing"), 69, "cannot be read"),
                                  (("save", "../maps"), 64, "name"),
                                  (("save",), 64, "needs the name"),
                                  (("reset", "x"), 64, "takes no name")):
            result = self.order(*words)
            self.assertEqual(result.returncode, code, words)
            self.assertIn(line, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1)

    def test_that_nobody_answers_is_said(self):
        result = self.order("save", "map", robot=NOBODY, operator=NOBODY)
        self.assertEqual(result.returncode, 69)
        self.assertIn("no slam answers", result.stderr)

    def test_the_map_survives_a_kill(self):
        self.wait_until_all_work()
        self.wait(lambda: list(self.root.glob("_running_slam_*/run.txt")), "the map is kept")
        log = self.folder / "poses.lcmlog"
        logger = subprocess.Popen(["lcm-logger", f"--lcm-url={ROBOT_URL}", "--channel=CAMERA_POSE",
                                   "--quiet", log])
        self.addCleanup(logger.wait)
        self.addCleanup(logger.send_signal, signal.SIGINT)
        wait_for(lambda: log.exists() and len(poses(log)) > 5, 30, "poses are recorded")
        killed = self.swarm.pids()["slam"]
        os.kill(killed, signal.SIGKILL)
        before = len(poses(log))
        self.wait(lambda: self.swarm.pids()["slam"] not in (0, killed), "a new slam")
        after = lambda: [p for p in poses(log)[before + 2:] if p[2] == TRACKING]
        self.wait(after, "it tracks again")
        last, first = poses(log)[before - 1], after()[0]
        self.assertEqual(first[1], last[1], "the epoch is the same")
        print(f"poses were missing for {(first[0] - last[0]) / 1e6:.2f} s")


if __name__ == "__main__":
    unittest.main()
