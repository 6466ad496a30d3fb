#!/usr/bin/python3
"""A recorded camera, played into a freshly deployed slam: a pose for each frame."""
import pathlib
import signal
import struct
import subprocess
import tempfile
import unittest

from swarm import (ROOT, Monitor, Swarm, build_dir, read_log, run, utimes, wait_for,
                   write_tiny_sequence)


class Recording:
    """scripts/record in the background; open once it is seen to receive."""

    def __init__(self, path, site):
        self.path = pathlib.Path(path)
        self.process = subprocess.Popen([ROOT / "scripts" / "record", site, path],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def events(self):
        return read_log(self.path) if self.path.exists() else []

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(20)


class RecordAndReplay(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def record(self, path, site):
        recording = Recording(path, site)
        self.addCleanup(recording.stop)
        return recording

    def record_camera(self, frames):
        """A log of CAMERA_INFO and at least so many frames."""
        source = write_tiny_sequence(self.folder / "tiny", frames=frames)
        camera = Swarm(f"  camera: {{params: {{source: {source}, loop: true}}}}\n")
        self.addCleanup(camera.close)
        camera.up()
        recording = self.record(self.folder / "camera.lcmlog", camera.site)
        wait_for(lambda: len(utimes(recording.events(), "IMAGE")) >= frames, 60, "frames recorded")
        self.assertEqual(recording.stop(), 0, "SIGINT ends it cleanly")
        camera.close()
        return recording.path

    def test_every_frame_of_a_played_log_gets_its_pose(self):
        log = self.record_camera(30)
        slam = Swarm("  slam: {}\n")
        self.addCleanup(slam.close)
        slam.up()
        monitor = Monitor()
        self.addCleanup(monitor.close)
        recording = self.record(self.folder / "slam.lcmlog", slam.site)
        wait_for(lambda: utimes(recording.events(), "HEALTH"), 20, "the recording has begun")
        played = run(ROOT / "scripts" / "replay", log, slam.site)
        self.assertEqual(played.returncode, 0, played.stderr)

        frames = set(utimes(read_log(log), "IMAGE"))
        info = min(utimes(read_log(log), "CAMERA_INFO"))
        usable = {t for t in frames if t > info}  # earlier ones come before the intrinsics
        self.assertGreater(len(usable), 15)

        def answered():
            skipped = monitor.port("slam", "IMAGE", "in")["skipped"]
            return len(set(utimes(recording.events(), "CAMERA_POSE"))) + skipped >= len(usable)
        wait_for(answered, 30, lambda: f"a pose for each of {len(usable)} frames; "
                 f"{len(utimes(recording.events(), 'CAMERA_POSE'))}; {monitor.summary()}")
        poses = utimes(recording.events(), "CAMERA_POSE")
        self.assertLessEqual(set(poses), frames, "a pose carries its frame's time")
        self.assertEqual(len(poses), len(set(poses)), "one pose for each frame")
        self.assertEqual(monitor.port("slam", "IMAGE", "in")["rejected"], 0)

    def publisher(self):
        """Somebody whose HEALTH can be recorded; the site's file."""
        swarm = Swarm("  carver: {}\n")
        self.addCleanup(swarm.close)
        swarm.up()
        return swarm.site

    def test_any_way_of_ending_leaves_a_whole_log(self):
        site = self.publisher()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            recording = self.record(self.folder / f"{number}.lcmlog", site)
            wait_for(lambda: utimes(recording.events(), "HEALTH"), 20, "HEALTH is recorded")
            recording.process.send_signal(number)
            self.assertEqual(recording.process.wait(20), 0)
            text = run(build_dir() / "bin" / "log-text", recording.path)
            self.assertEqual(text.returncode, 0, text.stderr)
            self.assertIn("HEALTH health_t", text.stdout)

    def test_a_full_disk_ends_the_recording_and_is_said(self):
        full = self.folder / "full.lcmlog"
        full.symlink_to("/dev/full")
        result = run(ROOT / "scripts" / "record", full, self.publisher(), timeout_s=60)
        self.assertEqual(result.returncode, 69, result.stderr)
        self.assertIn("full.lcmlog: log cannot be written: No space left", result.stderr)

    def test_a_damaged_log_is_played_to_its_end_and_said(self):
        frames = 20
        source = self.folder / "source.lcmlog"
        channel, data = b"POSE_HINT", b"x" * 50
        events = [struct.pack(">IqqII", 0xEDA1DA01, i, 10**15 + 10_000 * i, len(channel), len(data)) +
                  channel + data for i in range(frames)]
        damaged = events[7][:24] + b"\x7f\xff\xff\xff" + events[7][28:]
        source.write_bytes(b"".join(events[:7] + [damaged] + events[8:]))
        site = self.publisher()
        recording = self.record(self.folder / "played.lcmlog", site)
        wait_for(recording.events, 20, "the recording has begun")
        played = run(ROOT / "scripts" / "replay", source, site)
        self.assertEqual(played.returncode, 69, played.stderr)
        self.assertIn(f"source.lcmlog: damaged at byte {7 * len(events[0])} ", played.stderr)
        wait_for(lambda: sum(c == "POSE_HINT" for c, _ in recording.events()) == frames - 1, 20,
                 "all but the damaged one arrive")

    def test_what_cannot_be_played_or_recorded_is_said_in_a_line(self):
        missing = run(ROOT / "scripts" / "replay", "/no/such.lcmlog")
        self.assertEqual(missing.returncode, 69)
        self.assertIn("/no/such.lcmlog", missing.stderr)
        existing = self.folder / "old.lcmlog"
        existing.write_bytes(b"keep me")
        self.assertEqual(run(ROOT / "scripts" / "record", existing).returncode, 64)
        self.assertEqual(existing.read_bytes(), b"keep me")
        self.assertEqual(run(ROOT / "scripts" / "record", "nosite", "x.lcmlog").returncode, 78)


if __name__ == "__main__":
    unittest.main()
