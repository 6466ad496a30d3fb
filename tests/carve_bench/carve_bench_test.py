#!/usr/bin/python3
"""carve-bench on a small room: the numbers and files that scripts/carve_compare reads; the picture."""
import csv
import gzip
import json
import os
import pathlib
import random
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"
KEYFRAMES, POINTS_PER_KEYFRAME = 6, 40


def write_room(path):
    """A carvseq file: cameras in a cube of edge 2 m, points on its walls, one deletion."""
    rng = random.Random(3)
    lines = []
    for keyframe in range(KEYFRAMES):
        centre = [rng.uniform(-0.5, 0.5) for _ in range(3)]
        lines.append("K %d %g %g %g 1 0 0 0" % (keyframe, *centre))
        first = keyframe * POINTS_PER_KEYFRAME
        for point in range(first, first + POINTS_PER_KEYFRAME):
            place = [rng.uniform(-1, 1) for _ in range(3)]
            place[point % 3] = rng.choice((-1, 1))
            lines.append("P %d %g %g %g" % (point, *place))
        lines.append("O " + " ".join(map(str, range(first + POINTS_PER_KEYFRAME))))
    lines.append("D 7")
    path.write_bytes(gzip.compress("\n".join(lines).encode()))


class CarveBench(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.room = self.folder / "room.carv.gz"
        write_room(self.room)

    def bench(self, *arguments):
        return subprocess.run([BIN / "carve-bench", self.room, *map(str, arguments)], check=False,
                              capture_output=True, text=True)

    def mesh(self, energy):
        path = self.folder / f"{energy}.obj"
        self.assertEqual(self.bench("--energy", energy, "--mesh", path).returncode, 0)
        return path.read_text(encoding="utf-8")

    def test_soft_is_another_name_of_visibility(self):
        visibility = self.mesh("visibility")
        self.assertGreater(visibility.count("\nf "), 100)
        self.assertEqual(self.mesh("soft"), visibility)
        self.assertNotEqual(self.mesh("volume"), visibility)
        self.assertNotEqual(self.bench("--energy", "softer").returncode, 0)

    def test_times_single_events(self):
        events, numbers = self.folder / "events.csv", self.folder / "numbers.json"
        self.assertEqual(self.bench("--events", events, "--json", numbers).returncode, 0)
        with open(events, encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        kinds = [row["kind"] for row in rows]
        self.assertEqual(kinds, ["keyframe"] * KEYFRAMES + ["deletion"])
        self.assertEqual([int(row["points"]) for row in rows],
                         [POINTS_PER_KEYFRAME * n for n in range(1, KEYFRAMES + 1)]
                         + [POINTS_PER_KEYFRAME * KEYFRAMES - 1])
        self.assertTrue(all(float(row["carve_ms"]) > 0 < float(row["cut_ms"]) for row in rows))
        values = json.loads(numbers.read_text(encoding="utf-8"))
        mean = sum(float(row["carve_ms"]) for row in rows[:-1]) / KEYFRAMES
        self.assertAlmostEqual(values["keyframe_ms_mean"], mean, delta=0.01 * mean)
        # Its own memory, not that of whoever started it.
        self.assertGreater(values["peak_mb"], 0.1)
        self.assertLess(values["peak_mb"], 20)

    def test_draws_the_comparison(self):
        for name in ("s1k", "s3k"):
            self.assertEqual(self.bench("--events", self.folder / f"{name}.csv",
                                        "--json", self.folder / f"{name}.json").returncode, 0)
        picture = self.folder / "comparison.png"
        script = ROOT / "scripts" / "carve_compare"
        subprocess.run([script, "--json-in", self.folder, "--picture", picture], check=True)
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
        empty = subprocess.run([script, "--json-in", self.folder / "none"], check=False,
                               capture_output=True, text=True)
        self.assertEqual(empty.returncode, 69)
        self.assertIn("none", empty.stderr)


if __name__ == "__main__":
    unittest.main()
