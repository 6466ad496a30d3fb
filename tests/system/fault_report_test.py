#!/usr/bin/python3
"""scripts/fault_report: throws a fault, says what happened, writes it down."""
import json
import os
import pathlib
import tempfile
import unittest

from swarm import ROOT, build_dir, run


class FaultReport(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="foresight-faults-")
        self.addCleanup(folder.cleanup)
        self.out = pathlib.Path(folder.name)
        self.environment = os.environ | {"FORESIGHT_OUT_DIR": str(self.out),
                                         "FORESIGHT_BUILD_DIR": str(build_dir()),
                                         "FORESIGHT_FAULT_REPORT_INSIDE": "1"}

    def report(self, *arguments):
        return run(ROOT / "scripts" / "fault_report", *arguments, env=self.environment,
                   timeout_s=500)

    def test_a_killed_link_is_reported(self):
        result = self.report("--only", "link killed")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        row, = json.loads((self.out / "faults" / "faults.json").read_text(encoding="utf-8"))
        self.assertEqual((row["fault"], row["restarted"]), ("link killed", ["link"]))
        for key in ("reports_again_s", "itself_well_s", "all_well_s"):
            self.assertIsNotNone(row[key], row)
        table = (self.out / "faults" / "faults.md").read_text(encoding="utf-8").splitlines()
        self.assertEqual(len(table), 3)
        self.assertTrue(table[2].startswith("| link killed | "), table[2])
        self.assertIn(table[2], result.stdout)

    def test_a_fault_that_is_none_is_named(self):
        result = self.report("--only", "earthquake")
        self.assertEqual(result.returncode, 64, result.stderr)
        self.assertIn("earthquake", result.stderr)
        self.assertIn("link killed", result.stderr)


if __name__ == "__main__":
    unittest.main()
