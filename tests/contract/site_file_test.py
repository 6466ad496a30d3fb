#!/usr/bin/python3
"""Site files are read strictly: each error is one line that names file, key and value."""
import os
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import foresight_site  # noqa: E402  (the scripts are no package)
from foresight_site import SiteError  # noqa: E402

URLS = "robot_url: 'udpm://239.255.76.67:7667?ttl=0'\noperator_url: 'udpm://239.255.76.68:7668'\n"


# Values that may stand where another one belongs, as YAML text.
WRONG = ["5", "-1", "1.5", ".nan", "true", "null", "''", "text", "[]", "[1]", "[[a]]", "{}", "{a: 1}",
         "{a: {b: [c]}}", "2020-01-01", "2020-13-45", r'"\0"', r'"\ud800"', r'"a\nb"', r'"\e[2J"',
         "!!binary aGFsbG8=", "!!python/object:os.system x", "&a [*a]", "9" * 5000,
         "'%s %(here)s %'", "!!float x", "!!int []", "<<: [*b]", "? [a] : b", "text\0", "\udcff"]
HUGE = ["0x" + "f" * 30000, "[" * 700 + "]" * 700]  # slow to read
# Where something belongs, marked with @.
PLACES = ["@", "robot_url: @\noperator_url: udpm://\nprocesses: {link: {}}",
          "robot_url: udpm://\noperator_url: @\nprocesses: {link: {}}"]
PLACES += [URLS + text for text in (
    "processes: @", "processes: {@: {}}", "processes: {link: @}", "@: 1",
    "clock: @\nprocesses: {link: {}}", "external: @\nprocesses: {link: {}}",
    "external: {robot: @}\nprocesses: {link: {}}", "external: {robot: [@]}\nprocesses: {link: {}}",
    "external: {@: []}\nprocesses: {link: {}}", "arm_file: @\nprocesses: {link: {}}",
    "processes: {link: {@: 1}}",
    "processes: {link: {params: {@: 1}}}", "processes: {link: {params: {seed: @}}}",
    "processes: {link: {params: {to_operator_channels: @}}}")]
PLACES += [URLS + f"processes: {{link: {{{key}: @}}}}" for key in (
    "program", "site", "clock", "start", "restart", "nice", "params_file", "params")]


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
        self.assert_refused(URLS + "processes: {link: {params: {seed: [1, 2]}}}\n", "seed", "1 2")
        self.assert_refused(URLS + "processes: {link: {params: {seed: [[1]]}}}\n", "seed", "[1]")
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

    def test_a_list_is_handed_on_as_its_elements(self):
        site = self.read(URLS + "processes: {link: {params: "
                         "{to_operator_channels: [HEALTH, MESH], to_robot_channels: []}}}\n")
        self.assertEqual(site.processes[0].params["to_operator_channels"], "HEALTH MESH")
        self.assertEqual(site.processes[0].params["to_robot_channels"], "")
        ports = foresight_site.describe(site, site.processes[0])["inputs"]
        self.assertEqual(sorted(p["channel"] for p in ports if "pass on" in p["doc"]),
                         ["HEALTH", "MESH"])
        for bad in ("[[HEALTH]]", "[{a: b}]", "[HEALTH MESH]", "['a,b']", "['']", "[null]"):
            with self.assertRaises(SiteError, msg=bad):
                self.read(URLS + f"processes: {{link: {{params: {{to_operator_channels: {bad}}}}}}}\n")

    def test_the_arm_is_named_once_and_handed_to_who_knows_it(self):
        text = URLS + ("arm_file: deploy/arms/wam7.yaml\nprocesses: {omni: {}, link: {}, "
                       "sim: {params: {arm_file: deploy/arms/wam4.yaml}}}\n")
        site = self.read(text)
        commands = {p.name: p.command(site) for p in site.processes}
        self.assertIn("arm_file=deploy/arms/wam7.yaml", commands["omni"])
        self.assertNotIn("arm_file", " ".join(commands["link"]), "knows no arm")
        self.assertEqual([a for a in commands["sim"] if "arm_file" in a],
                         ["arm_file=deploy/arms/wam4.yaml"], "its own goes before")
        foresight_site.apply_assignment(site, "arm_file=deploy/arms/wam4.yaml")
        self.assertIn("arm_file=deploy/arms/wam4.yaml", site.processes[0].command(site))
        for bad in ("arm_file: 7\n", "arm_file: \n", "arm_file: [a]\n"):
            self.assert_refused(URLS + bad + "processes: {link: {}}\n", "arm_file")

    def test_unfed_inputs_names_who_listens_to_nobody(self):
        site = self.read(URLS + "external: {operator: [JOINT_COMMAND, SLAM_COMMAND, "
                         "SNAPSHOT_REQUEST]}\n"
                         "processes: {link: {params: {to_operator_channels: HEALTH MESH}}}\n")
        descriptions = {"link": foresight_site.describe(site, site.processes[0])}
        self.assertEqual(foresight_site.unfed_inputs(site, descriptions),
                         ["link listens to MESH (robot domain), which nobody publishes"])

    def test_any_value_in_any_place_is_read_or_refused_in_a_line(self):
        for place in PLACES:
            for wrong in WRONG + (HUGE if place == PLACES[-1] else []):
                text = place.replace("@", wrong)
                self.path.write_bytes(text.encode("utf-8", "surrogateescape"))
                try:
                    site = foresight_site.read_site(self.path)
                    for process in site.processes:  # what is read can stand on a command line
                        for word in process.command(site):
                            self.assertTrue(os.fsencode(word) and "\0" not in word, text[:200])
                except SiteError as error:
                    line = str(error)
                    self.assertIn("test.yaml", line)
                    self.assertTrue(line.isprintable() and len(line) < 2000, repr(line)[:300])

    def test_what_is_wrong_is_named(self):
        self.assert_refused(URLS + "external: {robot: 5}\nprocesses: {link: {}}\n",
                            "external.robot", "list of channels", "5")
        self.assert_refused(URLS + "processes: {link: {params_file: [1]}}\n",
                            "link.params_file", "[1]")
        self.assert_refused(URLS + "processes: {link: {program: 7}}\n", "link.program", "7")
        self.assert_refused(URLS + "processes: {7: {}}\n", "name", "7")
        self.assert_refused(URLS + "processes: {'a b': {}}\n", "a b", "letters")
        self.assert_refused("robot_url: 7\noperator_url: a\nprocesses: {link: {}}\n",
                            "robot_url", "7")

    def test_a_parameter_file_of_any_bytes_is_refused_in_a_line(self):
        for data in (b"seed: \xe9\n", b"\x1b[2J: 1\n", b"seed: [1\n", b"- 1\n"):
            (pathlib.Path(self.folder.name) / "link.yaml").write_bytes(data)
            site = self.read(URLS + "processes: {link: {params_file: link.yaml}}\n")
            with self.assertRaises(SiteError) as caught:
                foresight_site.describe(site, site.processes[0])
            self.assertTrue(str(caught.exception).isprintable(), repr(str(caught.exception)))

    def test_there_is_no_such_site(self):
        with self.assertRaises(SiteError) as caught:
            foresight_site.find_site_file("nowhere")
        self.assertIn("demo", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
