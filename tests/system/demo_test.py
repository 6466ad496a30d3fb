#!/usr/bin/python3
"""scripts/demo: whatever ends it, at whatever moment, nothing of it is left."""
import os
import pathlib
import resource
import signal
import subprocess
import tempfile
import unittest

from swarm import ROOT, Supervisor, build_dir, run, wait_for, write_tiny_sequence

GENEROUS_S = 120


class Demo(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="foresight-demo-")
        self.addCleanup(folder.cleanup)
        self.out = pathlib.Path(folder.name)
        self.environment = os.environ | {"FORESIGHT_OUT_DIR": str(self.out),
                                         "FORESIGHT_BUILD_DIR": str(build_dir())}
        self.robot = Supervisor(self.out / "run" / "demo")
        self.video = Supervisor(self.out / "run" / "video")
        self.addCleanup(self.robot.stop)
        self.addCleanup(self.video.stop)

    def demo(self, *arguments):
        """The demo in the background; its output is self.said()."""
        self.words = self.out / "words.txt"
        with open(self.words, "wb") as words:
            process = subprocess.Popen(
                [ROOT / "scripts" / "demo", "--headless", *map(str, arguments)],
                stdin=subprocess.DEVNULL, stdout=words, stderr=subprocess.STDOUT,
                env=self.environment, start_new_session=True)

        def end():
            process.kill()
            process.wait()
        self.addCleanup(end)
        return process

    def said(self):
        return self.words.read_text(encoding="utf-8", errors="replace")

    def wait(self, condition, what):
        wait_for(condition, GENEROUS_S, lambda: f"{what}: {self.said()}")

    def assert_nothing_left(self, supervisor):
        self.assertIsNone(supervisor.pid(), self.said())
        self.assertEqual(supervisor.members(), {}, self.said())

    def commands(self, supervisor):
        return set(supervisor.members().values())

    def test_a_signal_while_it_runs_ends_everything(self):
        for number in (signal.SIGTERM, signal.SIGHUP):
            demo = self.demo("--seconds", 0)
            self.wait(lambda: "moves" in self.said(), "it is up")
            self.assertIn("foresight-record", self.commands(self.robot))
            demo.send_signal(number)
            self.assertEqual(demo.wait(GENEROUS_S), 128 + number, self.said())
            self.assert_nothing_left(self.robot)

    def test_a_signal_while_it_starts_ends_everything(self):
        marks = (lambda: "foresight-record" in self.commands(self.robot),
                 lambda: self.robot.pid() is not None,
                 lambda: len(self.robot.members(companions=False)) >= 3)
        for mark in marks:
            for number in (signal.SIGTERM, signal.SIGINT):
                demo = self.demo("--seconds", 0)
                self.wait(mark, "it has begun")
                demo.send_signal(number)
                self.assertEqual(demo.wait(GENEROUS_S), 128 + number, self.said())
                self.assert_nothing_left(self.robot)

    def test_a_video_session_ends_with_a_signal(self):
        sequence = write_tiny_sequence(self.out / "tiny", frames=300)
        demo = self.demo("--video", sequence)
        self.wait(lambda: "showing" in self.said(), "it is up")
        demo.send_signal(signal.SIGTERM)
        self.assertEqual(demo.wait(GENEROUS_S), 128 + signal.SIGTERM, self.said())
        self.assert_nothing_left(self.video)

    def decoded(self, file):
        """(width, height, frames) of a film or a picture, every frame of which ffmpeg can read."""
        result = run("ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0",
                     "-show_entries", "stream=width,height,nb_read_frames", "-of", "csv=p=0", file)
        self.assertEqual((result.returncode, result.stderr), (0, ""), f"{file}: {self.said()}")
        return tuple(map(int, result.stdout.strip().rstrip(",").split(",")))

    def test_what_a_session_leaves_can_be_read(self):
        sequence = write_tiny_sequence(self.out / "tiny", frames=60)
        out = self.out / "session"
        demo = self.demo("--video", sequence, "--score-frames", 0, "--output", out,
                         "--set", "renderer.picture_width_px=160")
        self.assertEqual(demo.wait(GENEROUS_S), 0, self.said())
        width_px, height_px, frames = self.decoded(out / "demo.mp4")
        self.assertGreater(min(width_px, height_px), 50)
        self.assertGreater(frames, 30, "of six seconds")
        width_px, height_px, frames = self.decoded(out / "contact_sheet.png")
        self.assertGreater(width_px, 2 * 640)
        self.assertGreater(height_px, 6 * 100)
        self.assertEqual(frames, 1)
        self.assertIn(f"contact sheet {out / 'contact_sheet.png'}", self.said())
        self.assert_nothing_left(self.video)

    def test_killed_it_leaves_no_recorder_and_the_next_deploy_ends_the_rest(self):
        demo = self.demo("--seconds", 0)
        self.wait(lambda: "moves" in self.said(), "it is up")
        demo.kill()
        demo.wait()
        self.wait(lambda: "foresight-record" not in self.commands(self.robot), "no recorder")
        self.assertIn("foresight-sim", self.commands(self.robot))
        down = run(ROOT / "scripts" / "deploy", "down", "demo", env=self.environment)
        self.assertEqual(down.returncode, 0, down.stderr)
        self.assert_nothing_left(self.robot)

    def test_deploy_down_ends_the_recorders_too_and_the_demo(self):
        demo = self.demo("--seconds", 0)
        self.wait(lambda: "moves" in self.said(), "it is up")
        self.assertEqual(run(ROOT / "scripts" / "deploy", "down", "demo",
                             env=self.environment).returncode, 0)
        self.assertEqual(demo.wait(GENEROUS_S), 69, self.said())
        self.assertIn("the processes are gone", self.said())
        self.assert_nothing_left(self.robot)

    def test_a_recorder_that_fails_is_said(self):
        small = self.out / "small"
        demo = self.demo("--seconds", 0, "--output", small)
        self.wait(lambda: "moves" in self.said(), "it is up")
        recorders = [pid for pid, name in self.robot.members().items()
                     if name == "foresight-record"]
        for pid in recorders:  # the disk is full, as it seems to them
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (1000, 1000))
        self.wait(lambda: self.said().count("File too large") == len(recorders), "it is said")
        self.assertIn("robot.lcmlog", self.said())
        demo.send_signal(signal.SIGINT)
        self.assertEqual(demo.wait(GENEROUS_S), 69, self.said())
        self.assert_nothing_left(self.robot)

    def test_a_second_demo_leaves_the_first_alone(self):
        self.demo("--seconds", 0)
        self.wait(lambda: "moves" in self.said(), "it is up")
        log = self.out / "demo" / "robot.lcmlog"
        before = log.stat()
        second = run(ROOT / "scripts" / "demo", "--headless", env=self.environment)
        self.assertEqual(second.returncode, 69, second.stderr)
        self.assertIn("is up already", second.stderr)
        self.assertEqual(log.stat().st_ino, before.st_ino)
        self.assertIn("foresight-sim", self.commands(self.robot))


if __name__ == "__main__":
    unittest.main()
