#!/usr/bin/python3
"""Each program by itself: it ends when told to, and says in one line why it cannot start."""
import os
import pathlib
import signal
import subprocess
import tempfile
import unittest

from swarm import ROOT, URLS, build_dir, program, run, write_tiny_sequence

NAMES = sorted(p.parent.name for p in ROOT.glob("procs/*/process.h")
               if "kInfo" in p.read_text(encoding="utf-8"))


class Process(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        sequence = write_tiny_sequence(pathlib.Path(cls.folder.name) / "tiny")
        cls.needed = {"camera": ["--set", f"source={sequence}", "--set", "loop=true"],
                      "renderer": ["--set", "display=headless"]}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def command(self, name, urls=URLS):
        return [str(program(name)), *urls, *self.needed.get(name, [])]

    def assert_refuses(self, code, command, *parts):
        result = run(*command, timeout_s=20)
        self.assertEqual(result.returncode, code, f"{command}: {result.stderr}")
        lines = result.stderr.strip().splitlines()
        self.assertTrue(lines, command)
        for part in parts:
            self.assertIn(part, lines[-1])

    def test_ends_with_0_on_sigint_and_sigterm(self):
        for name in NAMES:
            for number in (signal.SIGINT, signal.SIGTERM):
                with subprocess.Popen(self.command(name), stderr=subprocess.PIPE,
                                      text=True) as process:
                    try:
                        self.assertEqual(run(program("top"), "--wait", name, "--timeout", 20,
                                             *URLS).returncode, 0, name)
                        process.send_signal(number)
                        self.assertEqual(process.wait(5), 0, f"{name}: {process.stderr.read()}")
                    finally:
                        process.kill()

    def test_bad_usage_is_64(self):
        for name in NAMES:
            self.assert_refuses(64, [program(name), "--no-such-option"], name, "no-such-option")
            self.assert_refuses(64, [program(name), "--set", "novalue"], "novalue", "key=value")
            self.assert_refuses(64, [program(name), "--replay", "a.lcmlog"], "--output")

    def test_bad_parameters_are_78(self):
        for name in NAMES:
            self.assert_refuses(78, [program(name), "--set", "no_such_key=1"], "no_such_key")
            self.assert_refuses(78, [program(name), "--params", "/no/such/file"], "/no/such/file")
            self.assert_refuses(78, [program(name), "--params", "/"], "cannot be read")
        self.assert_refuses(78, [program("link"), "--set", "to_robot_loss=7"],
                            "to_robot_loss", "7", "[0, 1]")
        self.assert_refuses(78, [program("camera"), *URLS, "--set", "source=/no/such/video"],
                            "/no/such/video")

    def test_a_bus_that_cannot_be_reached_is_69(self):
        for name in NAMES:
            # a network without any route, not even to itself
            self.assert_refuses(69, ["unshare", "--net", *self.command(name)],
                                "scripts/setup --network")
            nonsense = ["--robot-url", "nonsense://", "--operator-url", "nonsense://"]
            self.assert_refuses(69, self.command(name, nonsense), "nonsense://")

    def test_a_log_that_is_none_is_69(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in NAMES:
                self.assert_refuses(69, [program(name), *self.needed.get(name, []), "--replay",
                                         "/no/such/log", "--output", f"{folder}/out.lcmlog"],
                                    "/no/such/log")

    def test_a_recording_that_ends_with_refused_images_is_69(self):
        with tempfile.TemporaryDirectory() as folder:
            sequence = write_tiny_sequence(pathlib.Path(folder) / "tiny", frames=5, rate_hz=50)
            command = [program("camera"), *URLS, "--set", f"source={sequence}", "--set",
                       "exit_at_end=true"]
            whole = run(*command, timeout_s=20)
            self.assertEqual(whole.returncode, 0, whole.stderr)
            (sequence / "rgb" / "0003.png").write_bytes(b"no picture")
            self.assert_refuses(69, command, "camera: done", "1 of 5 images could not be used",
                                "0003.png")

    def test_top_says_who_is_missing(self):
        self.assert_refuses(69, [program("top"), *URLS, "--wait", "nobody", "--timeout", 0.3],
                            "nobody", "no health heard")
        self.assert_refuses(64, [program("top"), "--wait"])

    def test_scripts_run_names_the_programs(self):
        environment = dict(os.environ, FORESIGHT_BUILD_DIR=str(build_dir()))
        result = subprocess.run([ROOT / "scripts" / "run", "nonsense"], capture_output=True,
                                text=True, env=environment, timeout=120, check=False)
        self.assertEqual(result.returncode, 64, result.stderr)
        for name in ("nonsense", "slam", "top", "evaluate"):
            self.assertIn(name, result.stderr)


if __name__ == "__main__":
    unittest.main()
