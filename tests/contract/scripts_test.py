#!/usr/bin/python3
"""What the scripts in Python share: exit codes, one line for an error, parameters that must agree."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"
sys.path.insert(0, str(SCRIPTS))

import foresight_agreement  # noqa: E402  (the scripts are no package)
import foresight_site  # noqa: E402
import foresight_supervisord  # noqa: E402
from foresight_cli import Failure, one_line  # noqa: E402
from foresight_health import metric, parse_reports  # noqa: E402


def python_scripts():
    return sorted(p for p in SCRIPTS.iterdir()
                  if p.is_file() and not p.suffix and
                  p.read_text(encoding="utf-8").startswith("#!/usr/bin/python3"))


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=60, check=False)


class Usage(unittest.TestCase):
    def assert_usage(self, *command):
        result = run(*command)
        self.assertEqual(result.returncode, 64, f"{command}: {result.stderr}")
        lines = result.stderr.splitlines()
        self.assertEqual(len(lines), 1, result.stderr)
        self.assertTrue(lines[0].startswith(f"scripts/{command[0].name}: "), lines[0])

    def test_wrong_usage_is_64_in_every_script(self):
        names = [p.name for p in python_scripts()]
        self.assertLessEqual({"build", "demo", "deploy", "report", "run", "site_url", "test"},
                             set(names))
        for script in python_scripts():
            if script.name != "run":  # hands its arguments on
                self.assert_usage(script, "--no-such-option")

    def test_every_script_ends_by_the_one_way(self):
        for script in python_scripts():
            text = script.read_text(encoding="utf-8")
            self.assertIn("foresight_cli.run(main)", text, script.name)
            self.assertNotIn("import argparse", text, script.name)

    def test_values_that_are_no_numbers(self):
        demo, deploy = SCRIPTS / "demo", SCRIPTS / "deploy"
        for value in ("abc", "nan", "inf", "-1", ""):
            self.assert_usage(demo, f"--seconds={value}")
            self.assert_usage(demo, f"--delay={value}")
            self.assert_usage(demo, f"--score-frames={value}")
            self.assert_usage(deploy, "up", "demo", f"--timeout={value}")
        self.assert_usage(demo, "--score-frames=1.5")
        self.assert_usage(demo, "--operator", "nobody")
        self.assert_usage(demo, "--video", "/no/such/file")
        self.assert_usage(demo, "--camera", "/dev/null")
        self.assert_usage(deploy, "fly", "demo")
        self.assert_usage(SCRIPTS / "site_url", "demo", "moon")

    def test_what_cannot_be_read_or_written_is_69_and_named(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "file"
            file.write_text("", encoding="ascii")
            for command, part in ((["demo", "--output", file / "x"], str(file)),
                                  (["report", folder], "predictions.csv")):
                result = run(SCRIPTS / command[0], *command[1:])
                self.assertEqual(result.returncode, 69, result.stderr)
                self.assertIn(part, result.stderr)
                self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)


class Supervisord(unittest.TestCase):
    def test_it_looks_after_its_processes_often(self):
        waits = []
        poll = foresight_supervisord.looking_often(lambda _, timeout_s: waits.append(timeout_s))
        poll(None, 1)
        poll(None, 0)
        self.assertEqual(waits, [foresight_supervisord.LONGEST_WAIT_S, 0])

    def test_debians_supervisord_waits_in_the_poller(self):
        poller = foresight_supervisord.poller
        self.assertTrue(callable(poller.Poller.poll))
        source = pathlib.Path(foresight_supervisord.supervisord.__file__).read_text(encoding="utf-8")
        self.assertIn("self.options.poller.poll(timeout)", source)


class Texts(unittest.TestCase):
    def test_one_line_is_fit_for_a_terminal(self):
        for text in ("a\nb\r\tc", "\x1b[2Ja", "a\x00b", "\ud800", "a\u202eb", "x" * 10**6, 7, None):
            line = one_line(text)
            self.assertTrue(line.isprintable(), repr(line)[:100])
            self.assertLess(len(line), 500)
        self.assertEqual(one_line("noch 3 m übrig"), "noch 3 m übrig")

    def test_reports_of_any_content_are_read(self):
        rows = [{"process": "sl\x1bam", "state": "OK", "reason": "a\nb\udcff", "metrics": {"n": None}},
                {"process": "carver"}]
        reports = parse_reports(json.dumps({"processes": rows}))
        self.assertEqual(reports["sl am"]["reason"], "a b?")
        self.assertEqual(metric(reports, "sl am", "n"), 0)
        self.assertEqual(metric(reports, "carver", "n"), 0)
        self.assertEqual(metric(reports, "nobody", "n"), 0)
        for text in ("", "{", "[]", "7", '{"processes": 7}', '{"processes": [7]}'):
            self.assertEqual(parse_reports(text), {}, text)


class Agreement(unittest.TestCase):
    def setUp(self):
        self.site = foresight_site.read_site(ROOT / "deploy" / "demo.yaml")

    def disagreements(self, *assignments):
        for assignment in assignments:
            foresight_site.apply_assignment(self.site, assignment)
        descriptions = {p.name: foresight_site.describe(self.site, p) for p in self.site.processes}
        return foresight_agreement.disagreements(self.site, descriptions)

    def test_the_demo_agrees(self):
        self.assertEqual(self.disagreements(), [])

    def test_limits_that_the_renderer_predicts_with_are_the_controllers(self):
        for key, value in (("velocity_limit_rad_per_s", "0.15"),
                           ("acceleration_limit_rad_per_s2", "0.5"), ("limit_margin_rad", "0.1"),
                           ("command_timeout_s", "0.25")):
            self.setUp()
            lines = self.disagreements(f"renderer.{key}={value}")
            self.assertEqual(len(lines), 1, lines)
            for part in (key, "renderer", value, "wam_controller"):
                self.assertIn(part, lines[0])
            self.assertEqual(self.disagreements("renderer.predict=camera_pose"), [],
                             "who follows camera poses predicts no controller")

    def test_all_describe_one_arm(self):
        for process in ("sim", "wam_controller", "omni", "calibrator", "renderer"):
            self.setUp()
            lines = self.disagreements(f"{process}.arm_file=deploy/arms/wam7.yaml")
            self.assertTrue(any(f"{process} deploy/arms/wam7.yaml" in line for line in lines), lines)

    def test_a_site_with_another_arm_agrees(self):
        self.assertEqual(self.disagreements("arm_file=deploy/arms/wam7.yaml"), [])

    def test_one_arm_may_be_spelled_in_two_ways(self):
        self.assertEqual(self.disagreements(f"omni.arm_file={ROOT}/deploy/arms/wam4.yaml"), [])

    def test_commands_are_no_faster_than_the_controller(self):
        lines = self.disagreements("omni.max_velocity_rad_per_s=1.5")
        self.assertEqual(len(lines), 1, lines)
        self.assertIn("max_velocity_rad_per_s of omni (1.5)", lines[0])

    def test_a_difference_is_one_line_and_78(self):
        with self.assertRaises(Failure) as caught:
            foresight_site.apply_assignment(self.site, "renderer.command_timeout_s=0.2")
            descriptions = {p.name: foresight_site.describe(self.site, p)
                            for p in self.site.processes}
            foresight_agreement.require_agreement(self.site, descriptions)
        self.assertEqual(caught.exception.code, 78)
        result = run(SCRIPTS / "deploy", "check", "demo", "--set", "renderer.command_timeout_s=0.2")
        self.assertEqual(result.returncode, 78, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assertIn("command_timeout_s", result.stderr)


if __name__ == "__main__":
    unittest.main()
