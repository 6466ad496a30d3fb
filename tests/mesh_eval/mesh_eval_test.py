#!/usr/bin/python3
"""mesh-eval on a few seconds, rendered and real: the numbers that others read, picture, bad input."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"
DATA = pathlib.Path(os.environ.get("FORESIGHT_DATA") or ROOT / ".." / "shared" / "data")


def run(name, *arguments):
    return subprocess.run([BIN / name, *map(str, arguments)], capture_output=True, text=True,
                          check=False)


class MeshEval(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def evaluate(self, sequence, *options):
        file = self.folder / "numbers.json"
        done = run("mesh-eval", sequence, "--json", file, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        final, live = json.loads(file.read_text(encoding="utf-8"))
        head, line, *rows = done.stdout.splitlines()
        self.assertEqual([head.count("|")] * 3, [r.count("|") for r in (line, *rows)])
        self.assertEqual(list(final), [key.strip() for key in head.strip("|").split("|")])
        for row, numbers in zip(rows, (final, live)):
            self.assertTrue(row.startswith(f"| {sequence.name} | {numbers['mesh']} |"), row)
            shares = [numbers[key + "_share"] for key in ("measured", "guessed", "open")]
            self.assertAlmostEqual(sum(shares), 1, delta=0.002)
            self.assertAlmostEqual(
                numbers["within_10_percent"] + numbers["in_front_10_percent"]
                + numbers["behind_10_percent"], 1, delta=0.002)
        self.assertLessEqual(live["images"], final["images"])
        return final

    def render(self, name, *how):
        done = run("sim-sequence", self.folder / name, "--seed", 3, "--width", 320, "--fps", 15,
                   *how)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / name

    def refused(self, code, *arguments):
        done = run("mesh-eval", *arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        return done.stderr

    def test_scores_a_rendered_sequence_and_draws_it(self):
        final = self.evaluate(self.render("walk", "--seconds", 4, "--depth-every", 6),
                              "--picture", self.folder / "pictures")
        self.assertGreaterEqual(final["images"], 3)
        self.assertGreater(final["measured_share"], 0.4)
        self.assertGreater(final["within_10_percent"], 0.3)
        self.assertGreater(final["median_error_percent"], 0)
        self.assertAlmostEqual(final["metres_per_mu"] / final["truth_metres_per_mu"], 1, delta=0.1)
        self.assertGreater(final["triangles"], final["points"])
        picture = (self.folder / "pictures" / "walk.jpg").read_bytes()
        self.assertTrue(picture.startswith(b"\xff\xd8"))

    def test_settings_reach_the_mesher_and_runs_repeat(self):
        walk = self.render("walk", "--seconds", 4, "--depth-every", 6)
        first = self.evaluate(walk, "--every", 2)
        self.assertEqual(first, self.evaluate(walk, "--every", 2))
        volume = self.evaluate(walk, "--every", 2, "--set", "mesher.energy=volume")
        self.assertEqual(volume["metres_per_mu"], first["metres_per_mu"])
        self.assertNotEqual(volume["triangles"], first["triangles"])

    def test_images_that_cannot_be_used_are_named_after_the_scores(self):
        walk = self.render("walk", "--seconds", 4, "--depth-every", 6)
        sorted((walk / "rgb").iterdir())[50].unlink()
        sorted((walk / "depth").iterdir())[-2].write_bytes(b"")
        file = self.folder / "numbers.json"
        done = run("mesh-eval", walk, "--json", file)
        self.assertEqual(done.returncode, 69, done.stderr)
        final, _ = json.loads(file.read_text(encoding="utf-8"))
        self.assertEqual(final["refused_images"], 1)
        self.assertGreaterEqual(final["images"], 2)
        self.assertIn("1 of 60 images could not be used", done.stderr)
        self.assertIn("does not exist", done.stderr)
        self.assertIn("depth: 1 of", done.stderr)

    def test_scores_a_real_kitchen(self):
        kitchen = DATA / "redkitchen"
        if not (kitchen / "rgb.txt").exists():
            self.skipTest(f"{kitchen} is missing: set FORESIGHT_DATA to the folder of sequences")
        final = self.evaluate(kitchen, "--frames", 150)
        self.assertGreater(final["images"], 5)
        self.assertGreater(final["within_10_percent"], 0.5)

    def test_refuses_bad_input_in_one_line(self):
        self.assertIn("/nowhere", self.refused(78, "/nowhere"))
        plain = self.render("plain", "--seconds", 0.2, "--no-depth")
        self.assertIn("no depth images", self.refused(69, plain))
        turn = self.render("turn", "--seconds", 1, "--trajectory", "rotation")
        self.assertIn("no depth image shows a point", self.refused(69, turn))
        self.assertIn("mesher", self.refused(64, plain, "--set", "renderer.rate_hz=1"))
        self.assertIn("energy", self.refused(78, plain, "--set", "mesher.energy=kinetic"))


if __name__ == "__main__":
    unittest.main()
