#!/usr/bin/python3
"""Logs as people have them: damaged, cut off, shuffled, stepped; and outputs that would cost one."""
import os
import pathlib
import random
import resource
import signal
import struct
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"
WILD = pathlib.Path(os.environ.get("FORESIGHT_DATA") or ROOT.parent / "shared" / "data") / "wild"
HEADER = struct.Struct(">IqqII")


def events_of(log):
    """[(number, stamp, channel and data)] of a whole log."""
    events, at = [], 0
    while at < len(log):
        _, number, stamp, channel_size, size = HEADER.unpack_from(log, at)
        end = at + 28 + channel_size + size
        events.append((number, stamp, channel_size, log[at + 28:end]))
        at = end
    return events


def log_of(events):
    return b"".join(HEADER.pack(0xEDA1DA01, number, stamp, channel_size, len(body) - channel_size) +
                    body for number, stamp, channel_size, body in events)


class Logs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="foresight-logs-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([BIN / "replay-log", cls.folder / "session"], check=True, cwd=ROOT)
        cls.log = cls.folder / "session.robot.lcmlog"
        cls.output = cls.folder / "whole.lcmlog"
        result = cls.replay(cls.log, cls.output)
        assert result.returncode == 0, result.stderr

    @classmethod
    def replay(cls, log, output, process="carver", **options):
        return subprocess.run([BIN / f"foresight-{process}", "--replay", log, "--output", output],
                              capture_output=True, text=True, timeout=120, check=False, **options)

    def write(self, name, data):
        path = self.folder / name
        path.write_bytes(data)
        return path

    def assert_one_line(self, result, code, *parts):
        self.assertEqual(result.returncode, code, result.stderr)
        lines = [line for line in result.stderr.splitlines() if parts[0] in line]
        self.assertEqual(len(lines), 1, result.stderr)
        for part in parts:
            self.assertIn(part, lines[0])

    def test_the_output_is_never_the_input(self):
        mine = self.write("mine.lcmlog", self.log.read_bytes())
        (self.folder / "sub").mkdir()
        symbolic, hard = self.folder / "symbolic.lcmlog", self.folder / "hard.lcmlog"
        symbolic.symlink_to(mine)
        os.link(mine, hard)
        before = mine.read_bytes()
        for log in (mine, f"robot={mine}", f"operator={mine}", symbolic):
            for output in (mine, symbolic, hard, "mine.lcmlog", "./sub/../mine.lcmlog"):
                result = self.replay(log, output, cwd=self.folder)
                self.assert_one_line(result, 64, "--output", str(output), "--replay")
                self.assertEqual(mine.read_bytes(), before)
        both = subprocess.run([BIN / "foresight-carver", "--replay", self.log, "--replay", mine,
                               "--output", hard], capture_output=True, text=True, check=False)
        self.assert_one_line(both, 64, "--output")
        self.assertEqual(mine.read_bytes(), before)

    def test_a_run_that_fails_leaves_an_earlier_output_alone(self):
        output = self.write("earlier.lcmlog", self.output.read_bytes())
        before = output.read_bytes()

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        self.assert_one_line(self.replay(self.log, output, preexec_fn=limit), 69, str(output),
                             "File too large")
        self.assertEqual(output.read_bytes(), before)
        self.assertEqual(self.replay("/no/such/log", output).returncode, 69)
        self.assertEqual(output.read_bytes(), before)
        self.assertEqual(list(self.folder.glob("*.partial")), [])

    def test_a_full_disk_is_noticed(self):
        self.assert_one_line(self.replay(self.log, "/dev/full"), 69, "/dev/full", "No space left")

    def test_somebodys_file_is_not_replaced_by_a_log(self):
        notes = self.write("notes.txt", b"keep me")
        self.assert_one_line(self.replay(self.log, notes), 69, "notes.txt", "not an LCM log")
        self.assertEqual(notes.read_bytes(), b"keep me")

    def test_a_damaged_event_is_said_and_the_others_are_replayed(self):
        events = events_of(self.log.read_bytes())
        at = len(log_of(events[:-3]))
        for name, damage in (("sync", lambda d: d[:at] + b"\0\0\0\0" + d[at + 4:]),
                             ("length", lambda d: d[:at + 24] + b"\x7f\xff\xff\xff" + d[at + 28:]),
                             ("negative", lambda d: d[:at + 24] + b"\xff" * 4 + d[at + 28:]),
                             ("hole", lambda d: d[:at] + d[at + 9:])):
            log = self.write(f"{name}.lcmlog", damage(self.log.read_bytes()))
            output = self.folder / f"{name}.out.lcmlog"
            result = self.replay(log, output)
            self.assert_one_line(result, 69, str(log), f"damaged at byte {at} ", "bytes skipped")
            self.assertIn(f"replayed {len(events) - 1} events", result.stderr)
            self.assertTrue(events_of(output.read_bytes()))
            text = subprocess.run([BIN / "log-text", log], capture_output=True, text=True,
                                  check=False)
            self.assert_one_line(text, 69, str(log), f"damaged at byte {at} ")
            stamps = [line for line in text.stdout.splitlines() if not line.startswith(" ")]
            self.assertEqual(len(stamps), len(events) - 1)

    def test_no_arm_is_moved_along_what_is_left_of_a_motion(self):
        motion = self.write("motion.lcmlog", self.log.read_bytes()[:-11])
        result = subprocess.run(
            [BIN / "foresight-omni", "--replay", self.log, "--output", self.folder / "o.lcmlog",
             "--set", "device=recorded", "--set", f"device_path={motion}"],
            capture_output=True, text=True, timeout=60, check=False, cwd=ROOT)
        self.assert_one_line(result, 69, str(motion), "cut off")
        self.assertFalse((self.folder / "o.lcmlog").exists())

    def test_a_log_that_is_cut_off_is_said(self):
        data = self.log.read_bytes()
        log = self.write("cut.lcmlog", data[:-11])
        at = len(log_of(events_of(data)[:-1]))
        self.assert_one_line(self.replay(log, self.folder / "cut.out.lcmlog"), 69, str(log),
                             f"cut off at byte {at} ")

    def test_recorded_damage(self):
        for kind in ("log-length-crash", "log-sync-lost"):
            log = WILD / kind / "in.lcmlog"
            if not log.exists():
                self.skipTest(f"{log} is missing")
            for process in ("slam", "carver"):
                result = self.replay(log, self.folder / "wild.lcmlog", process)
                self.assert_one_line(result, 69, str(log), "damaged at byte 396 (132 bytes skipped)")
                self.assertIn("replayed 7 events", result.stderr)

    def test_a_shuffled_log_gives_what_the_whole_one_gives(self):
        events = [(i, 1_000_000_000_000 + 500_000 * i, size, body)
                  for i, (_, _, size, body) in enumerate(events_of(self.log.read_bytes()))]
        slow = self.write("slow.lcmlog", log_of(events))
        self.assertEqual(self.replay(slow, self.folder / "slow.out.lcmlog").returncode, 0)
        random.Random(4).shuffle(events)
        shuffled = self.write("shuffled.lcmlog", log_of(events))
        result = self.replay(shuffled, self.folder / "shuffled.out.lcmlog")
        self.assert_one_line(result, 69, str(shuffled), "the log is shuffled", f"of {len(events)}")
        self.assertEqual((self.folder / "shuffled.out.lcmlog").read_bytes(),
                         (self.folder / "slow.out.lcmlog").read_bytes())

    def test_a_step_of_the_recorders_clock_is_said_and_takes_no_time(self):
        events = events_of(self.log.read_bytes())
        middle = len(events) // 2
        for step_s, code in ((-3600, 69), (7200, 0), (2**40, 0)):
            stepped = [(n, t + (step_s * 1_000_000 if i >= middle else 0), size, body)
                       for i, (n, t, size, body) in enumerate(events)]
            log = self.write("stepped.lcmlog", log_of(stepped))
            output = self.folder / "stepped.out.lcmlog"
            self.assert_one_line(self.replay(log, output), code, str(log), "stepped")
            stamps = [t for _, t, _, _ in events_of(output.read_bytes())]
            self.assertLess(max(stamps) - min(stamps), 10_000_000)


if __name__ == "__main__":
    unittest.main()
