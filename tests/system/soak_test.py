#!/usr/bin/python3
"""scripts/soak: runs the site for a while, kills slam twice, tells what grows and draws it."""
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import tempfile
import types
import unittest

from swarm import ROOT, build_dir, run


def load_script(name):
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "scripts" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class Verdicts(unittest.TestCase):
    """What is called flat, from samples made up here."""

    def setUp(self):
        self.soak = load_script("soak")

    def summary(self, memory_mb, **more):
        """Of an hour in which slam needs memory_mb(minute)."""
        samples = [{"time_s": 60.0 * minute, "slam memory_mb": memory_mb(minute), "keyframes": 7,
                    "losses": 0} for minute in range(60)]
        state = {"samples": samples, "site": types.SimpleNamespace(
            processes=[types.SimpleNamespace(name="slam")]), "restarted": [],
            "longest_unwell": {}, "returns": {}} | more
        return self.soak.summary_of(types.SimpleNamespace(**state), [])

    def test_what_is_full_after_a_while_is_flat(self):
        self.assertEqual(self.summary(lambda minute: 100 + 10 * min(minute, 25))["complaints"], [])
        self.assertEqual(self.summary(lambda minute: 20 + minute % 7)["complaints"], [])

    def test_what_grows_to_the_end_is_said(self):
        complaint, = self.summary(lambda minute: 100 + 2 * minute)["complaints"]
        self.assertRegex(complaint, "^slam grows: 1[56][0-9] MB at half time, 2[01][0-9] MB at the")

    def test_the_dead_and_the_unwell_are_said(self):
        self.assertEqual(
            self.summary(lambda _: 100, restarted=["link"])["complaints"], ["link was restarted"])
        self.assertEqual(
            self.summary(lambda _: 100, longest_unwell={"omni": (90, "DEGRADED tired"),
                                                        "sim": (5, "WAITING")})["complaints"],
            ["omni was unwell for 90 s: DEGRADED tired"])


class Soak(unittest.TestCase):
    def test_half_a_minute(self):
        folder = tempfile.TemporaryDirectory(prefix="foresight-soak-")
        self.addCleanup(folder.cleanup)
        out = pathlib.Path(folder.name)
        environment = os.environ | {"FORESIGHT_OUT_DIR": str(out), "FORESIGHT_SOAK_INSIDE": "1",
                                    "FORESIGHT_BUILD_DIR": str(build_dir())}
        result = run(ROOT / "scripts" / "soak", "--minutes", "0.5", env=environment, timeout_s=500)
        # Half a minute is too short to be flat, but nobody may die.
        self.assertIn(result.returncode, (0, 69), result.stdout + result.stderr)
        summary = json.loads((out / "soak" / "soak.json").read_text(encoding="utf-8"))
        for complaint in summary["complaints"]:
            self.assertIn(" grows: ", complaint)
        self.assertEqual(len(summary["slam_returns_s"]), 2, summary)
        for value in summary["slam_returns_s"].values():
            self.assertGreater(value, 0)
        self.assertEqual(len(summary["memory_mb"]), 9)
        self.assertGreater(summary["prediction_px"][0]["median"], 0)
        self.assertTrue((out / "soak" / "soak.png").read_bytes().startswith(b"\x89PNG"))
        table = (out / "soak" / "soak.md").read_text(encoding="utf-8")
        self.assertIn("| slam [MB] | ", table)
        self.assertIn("tracks again after", table)


if __name__ == "__main__":
    unittest.main()
