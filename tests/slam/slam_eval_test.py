#!/usr/bin/python3
"""slam-eval on a few rendered seconds: the numbers that others read, the table and the plots."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"


def run(name, *arguments):
    return subprocess.run([BIN / name, *map(str, arguments)], check=True, capture_output=True,
                          text=True).stdout


def refuse(constant):
    raise ValueError(f"{constant} is no JSON")


class SlamEval(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def evaluate(self, name, *how):
        run("sim-sequence", self.folder / name, "--seed", 3, "--width", 320, "--fps", 15,
            "--no-depth", *how)
        run("slam-eval", self.folder / name, "--json", self.folder / "numbers.json",
            "--table", self.folder / "table.md", "--plots", self.folder / "plots")
        text = (self.folder / "numbers.json").read_text(encoding="utf-8")
        (numbers,) = json.loads(text, parse_constant=refuse)
        self.assertEqual(numbers["sequence"], name)
        return numbers

    def test_scores_a_sequence_that_it_tracks(self):
        numbers = self.evaluate("walk", "--seconds", 3)
        self.assertEqual(numbers["frames"], 45)
        self.assertGreater(numbers["tracked_fraction"], 0.4)
        self.assertLess(numbers["tracked_fraction"], 1)
        self.assertGreater(numbers["init_s"], 0.1)
        self.assertLess(numbers["init_s"], 2)
        self.assertGreater(numbers["ate_rmse_m"], 1e-6)
        self.assertLess(numbers["ate_rmse_m"], 0.02)
        self.assertGreater(numbers["track_ms_median"], 0)
        self.assertGreaterEqual(numbers["track_ms_p95"], numbers["track_ms_median"])
        self.assertGreaterEqual(numbers["keyframes"], 3)
        self.assertGreater(numbers["points"], 100)
        self.assertGreater(numbers["peak_mb"], 10)
        self.assertLess(numbers["peak_mb"], 1000)
        minute, = numbers["minutes"]
        self.assertEqual((minute["images"], minute["keyframes"]), (45, numbers["keyframes"]))
        self.assertAlmostEqual(minute["error_m_rmse"], numbers["ate_rmse_m"], places=6)
        self.assertGreater(minute["map_mb"], 0.1)
        head, line, row = (self.folder / "table.md").read_text(encoding="utf-8").splitlines()
        self.assertEqual(head.count("|"), row.count("|"))
        self.assertEqual(head.count("|"), line.count("|"))
        self.assertTrue(row.startswith("| walk |"), row)
        plot = (self.folder / "plots" / "walk_none.png").read_bytes()
        self.assertTrue(plot.startswith(b"\x89PNG"))

    def test_tells_what_becomes_of_a_map_minute_by_minute(self):
        run("sim-sequence", self.folder / "long", "--seed", 3, "--width", 128, "--fps", 1,
            "--no-depth", "--seconds", 150, "--antialiasing", "none", "--trajectory", "static")
        text = run("slam-eval", self.folder / "long", "--json", self.folder / "numbers.json")
        self.assertIn("  minute  keyframes  points", text)
        numbers, = json.loads((self.folder / "numbers.json").read_text(encoding="utf-8"))
        self.assertEqual([(m["minute"], m["images"]) for m in numbers["minutes"]],
                         [(0, 60), (1, 60), (2, 30)])

    def test_scores_a_sequence_without_any_pose(self):
        numbers = self.evaluate("turn", "--seconds", 1, "--trajectory", "rotation")
        self.assertEqual(numbers["tracked_fraction"], 0)
        self.assertEqual(numbers["init_s"], -1)
        self.assertEqual(numbers["ate_rmse_m"], -1)
        self.assertEqual(numbers["points"], 0)


if __name__ == "__main__":
    unittest.main()
