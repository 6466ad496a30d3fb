#!/usr/bin/python3
"""Each process on a log, deterministically: twice the same bytes, and the reference's fields.

usage: replay_test.py              compare (run by scripts/test)
       replay_test.py --update     write the references anew, then look at the difference in git

The input is a small synthetic session (replay-log), the same on every machine; slam gets a sequence
that sim renders. References are text, one line a field (log-text); numbers may differ by the
tolerance of their process, because graphics and vision libraries choose instructions by processor.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
REFERENCES = pathlib.Path(__file__).resolve().parent / "reference"
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"
UPDATE = "--update" in sys.argv

# Relative tolerance of numbers: exact arithmetic, or floating point of other libraries.
TOLERANCE = {"wam_controller": 1e-6, "carver": 0.0, "mesher": 1e-6, "link": 0.0, "renderer": 0.05}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def run(name, *arguments):
    subprocess.run([BIN / name, *map(str, arguments)], check=True, capture_output=True, cwd=ROOT)


def text_of(log):
    return subprocess.run([BIN / "log-text", log], check=True, capture_output=True,
                          text=True).stdout.splitlines()


def same(mine, reference, tolerance):
    """Equal but for numbers within the tolerance."""
    if mine == reference:
        return True
    if NUMBER.sub("#", mine) != NUMBER.sub("#", reference):
        return False
    pairs = zip(map(float, NUMBER.findall(mine)), map(float, NUMBER.findall(reference)))
    return all(abs(a - b) <= tolerance * max(abs(a), abs(b), 1e-3) for a, b in pairs)


def published(lines, channels):
    """{channel: [message, ...]} of a log's text, each message as one string without its time."""
    messages, current = {}, None
    for line in lines:
        if not line.startswith(" "):
            channel = line.split()[-2]
            current = [] if channel in channels else None
            if current is not None:
                messages.setdefault(channel, []).append(current)
        elif current is not None:
            current.append(line)
    return {channel: ["\n".join(m) for m in all_] for channel, all_ in messages.items()}


class Replay(unittest.TestCase):
    """One synthetic session for all tests."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="foresight-replay-")
        cls.path = pathlib.Path(cls.folder.name)
        run("replay-log", cls.path / "session")
        cls.robot = f"robot={cls.path}/session.robot.lcmlog"
        cls.operator = f"operator={cls.path}/session.operator.lcmlog"

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def replay(self, process, *inputs, extra=()):
        """Twice the same bytes; returns the path of the output log."""
        words = [word for log in inputs for word in ("--replay", log)]
        outputs = [self.path / f"{process}.{i}.lcmlog" for i in (1, 2)]
        for output in outputs:
            run(f"foresight-{process}", *words, "--output", output, *extra)
        self.assertEqual(outputs[0].read_bytes(), outputs[1].read_bytes(),
                         f"{process}: two replays of one log differ")
        return outputs[0]

    def compare(self, process, log):
        lines = text_of(log)
        reference = REFERENCES / f"{process}.txt"
        if UPDATE:
            REFERENCES.mkdir(exist_ok=True)
            reference.write_text("\n".join(lines) + "\n", encoding="utf-8")
            return
        expected = reference.read_text(encoding="utf-8").splitlines()
        for number, (mine, theirs) in enumerate(zip(lines, expected), 1):
            self.assertTrue(same(mine, theirs, TOLERANCE[process]),
                            f"{reference}:{number}: expected '{theirs}', got '{mine}'")
        self.assertEqual(len(lines), len(expected), f"{process}: number of fields")

    def test_carver(self):
        self.compare("carver", self.replay("carver", self.robot))

    def test_mesher(self):
        carving = self.replay("carver", self.robot)
        self.compare("mesher", self.replay("mesher", f"robot={carving}"))

    def test_mesher_exports_ply(self):
        carving = self.replay("carver", self.robot)
        ply = self.path / "mesh.ply"
        self.replay("mesher", f"robot={carving}", extra=["--set", f"export_ply={ply}"])
        self.assertTrue(ply.read_bytes().startswith(b"ply\nformat binary_little_endian"))
        missing = self.replay("mesher", f"robot={carving}",
                              extra=["--set", f"export_ply={self.path}/no/such/folder/m.ply"])
        text = "\n".join(text_of(missing))
        self.assertIn("MESH mesh_t", text, "a failed export does not stop the meshes")
        self.assertIn("no/such/folder", text, "health says why")

    def test_link(self):
        self.compare("link", self.replay("link", self.robot, self.operator,
                                         extra=["--set", "to_operator_jitter_s=0.02",
                                                "--set", "to_operator_loss=0.2"]))

    def test_renderer(self):
        carving = self.replay("carver", self.robot)
        mesh = self.replay("mesher", f"robot={carving}")
        self.compare("renderer", self.replay("renderer", self.robot, self.operator,
                                             f"operator={mesh}",
                                             extra=["--set", "display=headless"]))

    def test_wam_controller(self):
        self.compare("wam_controller",
                     self.replay("wam_controller", f"robot={self.path}/session.arm.lcmlog"))

    def test_a_recorded_session_of_the_robot(self):
        """What a process published in the closed loop comes out again when the session's log is
        replayed into it alone; and the session can be reported on."""
        run("evaluate", "--sim", "--base", "still", "--seconds", "10", "--every", "1000",
            "--set", "sim.camera_width_px=320", "--set", "sim.camera_rate_hz=10",
            "--log", self.path / "loop")
        logs = self.path / "loop" / "base_still_0.30"
        robot, operators = (f"{d}={logs}/{d}.lcmlog" for d in ("robot", "operator"))
        for process, log, channels in (("wam_controller", "robot", {"ARM_TORQUES", "JOINT_STATE"}),
                                       ("calibrator", "robot", {"ALIGNMENT", "BASE_POSE"}),
                                       ("omni", "operator", {"JOINT_COMMAND"})):
            output = self.replay(process, robot, operators)
            mine = published(text_of(output), channels)
            theirs = published(text_of(logs / f"{log}.lcmlog"), channels)
            self.assertEqual(set(theirs), channels, process)
            for channel in channels:
                self.assertGreater(len(theirs[channel]), 3, channel)
                # The replay goes on for a second after the log.
                self.assertEqual(mine[channel][:len(theirs[channel])], theirs[channel],
                                 f"{process}: {channel}")
        run("session-report", logs / "robot.lcmlog", logs / "operator.lcmlog",
            "--output", self.path / "report")
        summary = json.loads((self.path / "report" / "summary.json").read_text())[0]
        self.assertGreater(summary["predicted_frames"], 50)
        self.assertLess(summary["prediction_median_px"], 2)
        subprocess.run([ROOT / "scripts" / "report", self.path / "report"], check=True,
                       capture_output=True)
        self.assertGreater((self.path / "report" / "report.png").stat().st_size, 20_000)

    def test_slam(self):
        """On rendered images: the same bytes twice, and it tracks. (A reference to the last digit
        would tie the test to one processor: the images and the vision library vary.)"""
        run("sim-sequence", self.path / "lab", "--seconds", "3", "--fps", "20", "--width", "320",
            "--no-depth")
        run("sequence-log", self.path / "lab", self.path / "lab.lcmlog")
        output = self.replay("slam", f"robot={self.path}/lab.lcmlog")
        lines = text_of(output)
        states = [lines[i + 3].split()[-1] for i, line in enumerate(lines)
                  if line.endswith("CAMERA_POSE camera_pose_t")]
        self.assertEqual(len(states), 60, "one answer for each frame")
        self.assertGreater(states.count("1"), 30, "frames tracked")
        self.assertTrue(any("MAP_DELTA" in line for line in lines))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + [a for a in sys.argv[1:] if a != "--update"])
