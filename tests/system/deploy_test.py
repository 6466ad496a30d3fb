#!/usr/bin/python3
"""scripts/deploy: up, status, restart, down, and what it says when something is wrong."""
import os
import pathlib
import signal
import subprocess
import tempfile
import unittest

from foreign import HealthSender
from swarm import (OWNER, ROOT, Monitor, Swarm, identity, is_running, run, wait_for,
                   write_tiny_sequence)

OTHERS = """
  carver: {}
  mesher: {}
  link: {params: {to_operator_channels: CAMERA_INFO IMAGE HEALTH, to_operator_delay_s: 0.05}}
"""


class Deploy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.sequence = write_tiny_sequence(pathlib.Path(cls.folder.name) / "tiny")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def swarm(self, processes=None):
        camera = f"  camera: {{start: last, params: {{source: {self.sequence}, loop: true}}}}\n"
        swarm = Swarm(processes or OTHERS + camera)
        self.addCleanup(swarm.close)
        return swarm

    def test_goes_up_reports_and_goes_down_without_a_trace(self):
        swarm = self.swarm()
        table = swarm.up()
        pids = swarm.pids()
        for name in ("camera", "link", "carver", "mesher"):
            self.assertRegex(table, rf"{name} +robot +(RUNNING|STARTING) +{pids[name]} ")
        monitor = Monitor()
        self.addCleanup(monitor.close)
        wait_for(lambda: 8 < monitor.port("camera", "IMAGE", "out")["rate_hz"] < 12, 20,
                 "10 frames a second")
        wait_for(lambda: monitor.port("link", "IMAGE", "out", "operator")["rate_hz"] > 8, 10,
                 "the link carries them")
        wait_for(lambda: all(0.8 < monitor.port(n, "HEALTH", "out")["rate_hz"] < 2.5
                             for n in pids), 10, "health once a second")
        self.assertEqual(swarm.deploy("status").returncode, 0)
        self.assertIn("is down", swarm.deploy("down").stdout)
        self.assertEqual(swarm.supervisor.members(), {})
        for pid in pids.values():
            self.assertFalse(is_running(pid))
        self.assertFalse((swarm.run_dir / "supervisord.sock").exists())
        self.assertEqual(swarm.deploy("status").returncode, 69)
        for log in swarm.run_dir.glob("logs/*.log"):  # SIGINT sufficed, nobody complained
            self.assertNotIn("bug", log.read_text(encoding="utf-8"))

    def test_up_twice_is_refused(self):
        swarm = self.swarm("  carver: {}\n")
        swarm.up()
        again = swarm.deploy("up")
        self.assertEqual(again.returncode, 69)
        self.assertIn("up already", again.stderr)

    def test_wrong_parameters_are_refused_before_anything_starts(self):
        swarm = self.swarm()
        for assignment, part in (("camera.speed=1000", "[0.01, 100]"), ("camera.sped=1", "sped"),
                                 ("carmera.speed=1", "carmera"), ("speed=1", "PROCESS.KEY")):
            result = swarm.deploy("up", "--set", assignment)
            self.assertEqual(result.returncode, 78, assignment)
            self.assertIn(part, result.stderr)
            self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        self.assertIsNone(swarm.supervisor.pid())

    def test_a_process_that_does_not_stay_up_ends_the_attempt(self):
        swarm = self.swarm("  carver: {}\n  camera: {start: last, params: {source: /nowhere}}\n")
        result = swarm.deploy("up")
        self.assertEqual(result.returncode, 69, result.stdout)
        self.assertIn("/nowhere", result.stderr)
        self.assertEqual(swarm.supervisor.members(), {}, "nothing half-started stays")
        self.assertIsNone(swarm.supervisor.pid())

    def test_a_run_directory_may_have_any_name(self):
        for name in ("50 % done", "a;b #c", "it's \"it\"", "%(here)s", "ünï"):
            swarm = self.swarm("  carver: {}\n")
            swarm.move_run_dir(name)
            swarm.up()
            self.assertEqual(swarm.deploy("status").returncode, 0)
            self.assertIn("no map yet", swarm.deploy("logs", "carver").stdout)
            self.assertIn("(1 processes ended)", swarm.deploy("down").stdout)
            self.assertEqual(swarm.supervisor.members(), {})

    def test_a_parameter_may_have_any_text(self):
        swarm = self.swarm("  eye: {program: camera, params: {source: '/no/%s ;a #b $HOME `x`'}}\n")
        result = swarm.deploy("up")
        self.assertEqual(result.returncode, 69, result.stderr)
        self.assertIn("/no/%s ;a #b $HOME `x`", result.stderr)

    def test_a_run_directory_that_cannot_be_written_is_named(self):
        swarm = self.swarm("  carver: {}\n")
        for path in ("/proc/nowhere", str(swarm.site) + "/below"):
            result = run(ROOT / "scripts" / "deploy", "up", swarm.site, "--run-dir", path)
            self.assertEqual(result.returncode, 69, result.stderr)
            self.assertIn(path, result.stderr)
            self.assertNotIn("answer", result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)

    def test_a_second_swarm_on_the_same_urls_is_refused(self):
        first, second = (self.swarm("  carver: {}\n  link: {}\n") for _ in range(2))
        first.up()
        pids = first.pids()
        refused = second.deploy("up")
        self.assertEqual(refused.returncode, 69, refused.stdout)
        self.assertEqual(len(refused.stderr.splitlines()), 1, refused.stderr)
        for name in ("carver", "link"):
            self.assertIn(f"{name} (pid {pids[name]})", refused.stderr)
        self.assertEqual(second.supervisor.members(), {})
        self.assertIsNone(second.supervisor.pid())
        self.assertEqual(first.pids(), pids, "the first one goes on")
        self.assertEqual(first.deploy("status").returncode, 0)

        forced = second.deploy("up", "--force")
        self.assertEqual(forced.returncode, 0, forced.stderr)
        status = first.deploy("status")
        self.assertEqual(status.returncode, 69, "two commanders are not well")
        self.assertIn("not of this site", status.stdout)
        self.assertIn(f"carver (pid {second.pids()['carver']})", status.stdout)
        self.assertNotIn(f"(pid {pids['carver']})", status.stdout)

    def test_of_two_that_begin_at_the_same_time_one_stays_at_most(self):
        processes = "".join(f"  c{i}: {{program: carver}}\n" for i in range(4))
        swarms = [self.swarm(processes) for _ in range(2)]
        begun = [subprocess.Popen([ROOT / "scripts" / "deploy", "up", s.site, "--run-dir",
                                   s.run_dir], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True) for s in swarms]
        ends = [(p.communicate(timeout=120)[1], p.returncode) for p in begun]
        up = [s for s in swarms if s.supervisor.members()]
        self.assertLessEqual(len(up), 1, ends)
        for complaint, code in ends:
            self.assertIn(code, (0, 69), ends)
            self.assertTrue(code == 0 or "another swarm" in complaint, ends)
        self.assertEqual(sum(code == 0 for _, code in ends), len(up), ends)

    def test_a_swarm_beside_others_on_the_same_urls_is_not_refused(self):
        """The other host of a site, and what people run by hand."""
        first, second = self.swarm("  carver: {}\n"), self.swarm("  link: {}\n")
        first.up()
        second.up()
        self.assertEqual(second.deploy("status").returncode, 0)

    def test_what_a_killed_script_left_is_ended_by_the_next_up(self):
        swarm = self.swarm("  carver: {}\n")
        with subprocess.Popen(["sleep", "600"]) as owner:
            environment = os.environ | {OWNER: identity(owner.pid)}
            self.assertEqual(swarm.deploy("up", env=environment).returncode, 0)
            pids = swarm.pids()
            self.assertEqual(swarm.deploy("up").returncode, 69, "its owner lives")
            other = os.environ | {OWNER: identity(os.getpid())}
            self.assertEqual(swarm.deploy("down", env=other).returncode, 0)
            self.assertEqual(swarm.pids(), pids, "a script takes down its own site only")
            owner.kill()
        result = swarm.deploy("up")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("left by a script that was killed", result.stdout)
        self.assertFalse(is_running(pids["carver"]))

    def test_health_of_any_bytes_is_shown(self):
        swarm = self.swarm("  carver: {}\n")
        swarm.up()
        for reason in (b"\xff\xfe caf\xe9 word", b"\x1b[2J\x07\r\n word", b"\xed\xa0\x80 word",
                       b"word" * 3000, b'"\\u0000\\ word'):
            for process in (b"carver", b"\xe9\x1b"):
                with HealthSender(process, reason):
                    status = swarm.deploy("status")
                    self.assertIn("carver", status.stdout)
                    self.assertEqual("word" in status.stdout, process == b"carver", status.stdout)
                    self.assertTrue(all(line.isprintable() for line in status.stdout.splitlines()),
                                    repr(status.stdout))
                    self.assertEqual(status.stderr, "")

    def test_a_host_without_multicast_is_told_what_mends_it(self):
        swarm = self.swarm("  carver: {}\n")
        result = subprocess.run(
            ["unshare", "--net", ROOT / "scripts" / "deploy", "up", swarm.site, "--run-dir",
             swarm.run_dir], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(result.returncode, 69, result.stderr)
        self.assertIn("scripts/setup --network", result.stderr)

    def assert_ends_once(self, sequence, exit_code):
        camera = (f"  camera: {{start: last, params: {{source: {sequence}, speed: 0.4, "
                  f"exit_at_end: true}}}}\n")
        swarm = self.swarm("  carver: {}\n" + camera)
        swarm.up()
        wait_for(lambda: swarm.supervisor.processes()["camera"]["statename"] == "EXITED", 30,
                 "the camera ends")
        self.assertEqual(swarm.supervisor.processes()["camera"]["exitstatus"], exit_code)
        status = swarm.deploy("status")
        self.assertEqual(status.returncode, exit_code, status.stdout)
        self.assertRegex(status.stdout, "camera +robot +EXITED")

    def test_a_source_that_has_ended_is_not_restarted(self):
        self.assert_ends_once(self.sequence, 0)

    def test_nor_is_one_with_images_that_were_refused(self):
        damaged = write_tiny_sequence(pathlib.Path(self.folder.name) / "damaged")
        (damaged / "rgb" / "0003.png").write_bytes(b"no picture")
        self.assert_ends_once(damaged, 69)

    def test_restart_gives_one_process_a_new_pid_and_keeps_the_others(self):
        swarm = self.swarm()
        swarm.up("--set", "camera.speed=2")
        before = swarm.pids()
        result = swarm.deploy("restart", "camera")
        self.assertEqual(result.returncode, 0, result.stderr)
        after = swarm.pids()
        self.assertNotEqual(before.pop("camera"), after.pop("camera"))
        self.assertEqual(before, after)

    def test_restart_of_all_keeps_what_was_set(self):
        swarm = self.swarm("  link: {}\n  carver: {}\n")
        swarm.up("--set", "link.seed=77")
        before = swarm.pids()
        self.assertEqual(swarm.deploy("restart").returncode, 0)
        self.assertTrue(all(pid != before[name] for name, pid in swarm.pids().items()))
        command = pathlib.Path(f"/proc/{swarm.pids()['link']}/cmdline").read_bytes()
        self.assertIn(b"seed=77", command)

    def test_orphans_of_a_killed_supervisor_are_named_and_ended(self):
        swarm = self.swarm("  link: {}\n  carver: {}\n")
        swarm.up()
        pids = swarm.pids()
        os.kill(swarm.supervisor.pid(), signal.SIGKILL)
        wait_for(lambda: swarm.supervisor.pid() is None, 5, "the supervisor is gone")
        status = swarm.deploy("status")
        self.assertEqual(status.returncode, 69)
        for name in ("foresight-link", "foresight-carver"):
            self.assertIn(f"{name} ({pids[name.removeprefix('foresight-')]})", status.stdout)
        self.assertIn("down", swarm.deploy("up").stderr, "no second swarm beside them")
        self.assertEqual(swarm.deploy("down").returncode, 0)
        self.assertEqual(swarm.supervisor.members(), {})

    def test_only_one_sites_processes_can_be_started(self):
        swarm = self.swarm("  carver: {}\n  link: {site: operator}\n")
        swarm.up("--on", "operator")
        self.assertEqual(list(swarm.pids()), ["link"])

    def test_logs_are_shown(self):
        swarm = self.swarm("  carver: {}\n")
        swarm.up()
        self.assertIn("no map yet", swarm.deploy("logs", "carver").stdout)
        self.assertEqual(swarm.deploy("logs", "nobody").returncode, 69)


if __name__ == "__main__":
    unittest.main()
