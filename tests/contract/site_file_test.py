#!/usr/bin/python3
"""Site files are read strictly: each error is one line that names file, key and value."""
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import foresight_site  # noqa: E402  (the scripts are no package)
from foresight_site import SiteError  # noqa: E402

URLS = "robot_url: 'udpm://239.255.76.67:7667?ttl=0'\noperator_url: 'udpm://239.255.76.68:7668'\n"


class SiteFile(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name) / "test.yaml"

    def read(self, text):
        self.path.write_text(text, encoding="utf-8")
        return foresight_site.read_site(self.path)

    def assert_refused(self, text, *parts):
        with self.assertRaises(SiteError) as caught:
            site = self.read(text)
            for process in site.processes:
                foresight_site.describe(site, process)
        line = str(caught.exception)
        self.assertNotIn("\n", line)
        for part in ("test.yaml", *parts):
            self.assertIn(part, line)

    def test_a_site_may_live_by_a_published_clock(self):
        site = self.read(URLS + "clock: published\nprocesses:\n  link: {}\n"
                         "  eye: {program: camera, clock: wall}\n")
        self.assertEqual([p.clock for p in site.processes], ["published", "wall"])
        line = site.processes[0].command(site)
        self.assertEqual(line[line.index("--clock") + 1], "published")
        self.assert_refused(URLS + "clock: moon\nprocesses:\n  link: {}\n", "clock", "moon")

    def test_reads_processes_with_defaults(self):
        site = self.read(URLS + "processes:\n  link: {}\n"
                         "  eye: {program: camera, start: last, params: {loop: true, speed: 2}}\n")
        self.assertEqual([p.name for p in site.processes], ["link", "eye"])
        link, eye = site.processes
        self.assertEqual((link.program, link.site, link.start, link.restart),
                         ("link", "robot", "first", "on_failure"))
        self.assertEqual(eye.program, "camera")
        self.assertEqual(eye.params, {"loop": "true", "speed": "2"})
        self.assertIn("--set", eye.command(site))
        self.assertIn("loop=true", eye.command(site))

    def test_refuses_unknown_keys_at_every_level(self):
        self.assert_refused(URLS + "proceses: {}\n", "proceses", "processes")
        self.assert_refused(URLS + "processes: {link: {prams: {}}}\n", "link", "prams", "params")
        self.assert_refused(URLS + "external: {moon: [A]}\nprocesses: {link: {}}\n", "moon")

    def test_refuses_values_that_are_no_choice(self):
        self.assert_refused(URLS + "processes: {link: {site: moon}}\n", "site", "moon", "operator")
        self.assert_refused(URLS + "processes: {link: {restart: maybe}}\n", "restart", "maybe")
        for nice in ("20", "-1", "fast", "true"):
            self.assert_refused(URLS + f"processes: {{link: {{nice: {nice}}}}}\n", "nice")

    def test_refuses_a_key_given_twice(self):
        self.assert_refused(URLS + "processes:\n  link: {}\n  link: {}\n", "link", "twice")

    def test_refuses_what_is_missing(self):
        self.assert_refused("processes: {link: {}}\n", "robot_url")
        self.assert_refused(URLS, "processes")
        self.assert_refused("", "robot_url")

    def test_refuses_what_is_no_yaml_or_no_map(self):
        self.assert_refused("a: [", "not YAML")
        self.assert_refused("- a\n", "map")
        self.assert_refused(URLS + "processes: [link]\n", "processes", "map")
        self.assert_refused(URLS + "processes: {link: 7}\n", "link", "map")
        self.assert_refused(URLS + "processes: {link: {params: {seed: [1]}}}\n", "seed", "[1]")
        self.assert_refused(URLS + "processes: {link: {params: {seed: }}}\n", "seed")

    def test_the_program_refuses_its_parameters(self):
        self.assert_refused(URLS + "processes: {link: {params: {sead: 1}}}\n", "sead", "seed")
        self.assert_refused(URLS + "processes: {link: {params: {to_robot_loss: 2}}}\n",
                            "to_robot_loss", "2", "[0, 1]")
        self.assert_refused(URLS + "processes: {link: {params_file: none.yaml}}\n", "none.yaml")

    def test_refuses_a_program_that_does_not_exist(self):
        self.assert_refused(URLS + "processes: {lnk: {}}\n", "lnk", "no program")

    def test_parameters_may_stand_in_a_file_of_their_own(self):
        (pathlib.Path(self.folder.name) / "link.yaml").write_text("to_robot_delay_s: 0.5\n",
                                                                  encoding="utf-8")
        site = self.read(URLS + "processes: {link: {params_file: link.yaml, params: {seed: 4}}}\n")
        params = {p["key"]: str(p["value"])
                  for p in foresight_site.describe(site, site.processes[0])["params"]}
        self.assertEqual(params["to_robot_delay_s"], "0.5")
        self.assertEqual(params["seed"], "4")

    def test_assignments_override_the_file(self):
        site = self.read(URLS + "processes: {link: {params: {seed: 4}}}\n")
        foresight_site.apply_assignment(site, "link.seed=5")
        self.assertEqual(site.processes[0].params["seed"], "5")
        for bad in ("link.seed", "seed=5", "nobody.seed=5", "link.=5"):
            with self.assertRaises(SiteError, msg=bad):
                foresight_site.apply_assignment(site, bad)

    def test_unfed_inputs_names_who_listens_to_nobody(self):
        site = self.read(URLS + "external: {operator: [JOINT_COMMAND, SLAM_COMMAND, "
                         "SNAPSHOT_REQUEST]}\n"
                         "processes: {link: {params: {to_operator_channels: HEALTH MESH}}}\n")
        descriptions = {"link": foresight_site.describe(site, site.processes[0])}
        self.assertEqual(foresight_site.unfed_inputs(site, descriptions),
                         ["link listens to MESH (robot domain), which nobody publishes"])

    def test_there_is_no_such_site(self):
        with self.assertRaises(SiteError) as caught:
            foresight_site.find_site_file("nowhere")
        self.assertIn("demo", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
