#!/usr/bin/python3
"""What the parts of the tree promise each other, checked on the files and on the built programs."""
import pathlib
import re
import subprocess
import sys
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import foresight_site  # noqa: E402  (the scripts are no package)
from foresight_paths import program  # noqa: E402

# Files of a process folder that may know the bus, the clock or a device.
SHELL = re.compile(r"process(_[a-z]+)?\..*|(.*_)?main\.cc|params\.h|.*_source\..*|recorder\..*|gl_context\..*"
                   r"|.*_device\..*|device_.*")
# What a core must not include, and what for.
NOT_IN_A_CORE = {
    r"<lcm/.*": "the bus", r'"foresight/.*_t\.hpp"': "messages",
    r'"common/(host|node|live_host|lcm_bus|lcm_log|process_main|simulation|delta_stream)\.h"':
        "the process host",
    r'"common/(delta_input|snapshot_requester)\.h"': "the process host",
    r"<(chrono|ctime|sys/time\.h)>": "a clock",
    r"<(thread|mutex|condition_variable|future)>": "threads"}
# Cores whose very subject is messages.
ABOUT_MESSAGES = {"procs/camera/frame_converter.h", "procs/top/health_table.h"}
CORE_OF_COMMON = ["arm_model", "camera_model", "carving_delta", "clock_offset", "frames", "image",
                  "joint_reference", "map_delta", "mesh", "newest_stamp", "persistent_value",
                  "pose_track", "printable_text", "snapshot_gate", "stamp_gate", "stream_losses",
                  "time", "trapezoid"]


def sources(folder):
    return sorted(p for p in (ROOT / folder).rglob("*") if p.suffix in (".h", ".cc"))


def includes(path):
    return re.findall(r'^\s*#include\s+(<[^>]+>|"[^"]+")', path.read_text(encoding="utf-8"), re.M)


def relative(path):
    return str(path.relative_to(ROOT))


def process_folders():
    """{name: folder} of processes: those with a ProcessInfo. foresight-top is a tool without."""
    folders = {}
    for path in (*ROOT.glob("procs/*/process.h"), *ROOT.glob("sim/*/process.h")):
        info = re.search(r'kInfo\{\s*"([^"]+)"', path.read_text(encoding="utf-8"))
        if info:
            folders[info[1]] = path.parent
    return dict(sorted(folders.items()))


def process_names():
    return list(process_folders())


class Layers(unittest.TestCase):
    def test_no_process_includes_another(self):
        for path in sources("procs"):
            own = f'"procs/{path.relative_to(ROOT / "procs").parts[0]}/'
            for include in includes(path):
                if include.startswith('"procs/'):
                    self.assertTrue(include.startswith(own), f"{relative(path)} includes {include}")

    def test_common_includes_nothing_of_ours_above_it(self):
        for path in sources("common"):
            for include in includes(path):
                if include.startswith('"'):
                    self.assertRegex(include, r'"(common|foresight)/', relative(path))

    def test_no_product_stands_on_tools_or_tests(self):
        for folder in ("common", "procs", "sim"):
            for path in sources(folder):
                for include in includes(path):
                    self.assertNotRegex(include, r'"(bench|tests)/', relative(path))

    def test_the_core_of_common_is_pure(self):
        for name in CORE_OF_COMMON:
            for path in (ROOT / "common").glob(f"{name}.*"):
                self.check_core(path)

    def test_sim_stands_on_common_alone(self):
        for path in sources("sim"):
            if relative(path).startswith("sim/swarm/"):  # all processes in one thread
                continue
            for include in includes(path):
                if include.startswith('"'):
                    self.assertRegex(include, r'"(common|foresight|sim)/', relative(path))

    def test_cores_know_no_bus_no_clock_and_no_thread(self):
        for path in sources("procs"):
            if not SHELL.fullmatch(path.name):
                self.check_core(path)

    def check_core(self, path):
        for include in includes(path):
            for pattern, what in NOT_IN_A_CORE.items():
                if what == "messages" and relative(path) in ABOUT_MESSAGES:
                    continue
                self.assertIsNone(re.fullmatch(pattern, include),
                                  f"{relative(path)} is a core and includes {include}: {what}")

    def test_nothing_draws_from_chance_or_the_wall_clock(self):
        for folder in ("procs", "common", "sim"):
            for path in sources(folder):
                text = path.read_text(encoding="utf-8")
                self.assertNotRegex(text, r"random_device|\bs?rand\(|gettimeofday", relative(path))
                self.assertNotRegex(text, r"\bu?sleep\(|sleep_for|nanosleep", relative(path))

    def test_every_process_has_the_one_shape(self):
        for folder in process_folders().values():
            for file in ("main.cc", "process.h", "process.cc", "params.h", "README.md",
                         "CMakeLists.txt"):
                self.assertTrue((folder / file).exists(), f"{relative(folder)} has no {file}")
            lines = (folder / "main.cc").read_text(encoding="utf-8").splitlines()
            self.assertLessEqual(len(lines), 20, f"{relative(folder)}/main.cc")

    def test_a_process_of_procs_bears_the_name_of_its_folder(self):
        for name, folder in process_folders().items():
            if folder.parent.name == "procs":
                self.assertEqual(name, folder.name)


class Descriptions(unittest.TestCase):
    def describe(self, name):
        result = subprocess.run([program(name), "--describe"], capture_output=True, text=True,
                                check=False)
        self.assertEqual(result.returncode, 0, f"{name}: {result.stderr}")
        return yaml.safe_load(result.stdout)

    def test_who_knows_the_arm_is_handed_the_sites(self):
        with_arm = {name for name in process_names()
                    if "arm_file" in (p["key"] for p in self.describe(name)["params"])}
        self.assertEqual(with_arm, set(foresight_site.ARM_PROGRAMS))

    def test_every_process_describes_itself(self):
        self.assertIn("slam", process_names())
        types = {p.stem for p in (ROOT / "lcmtypes").glob("*.lcm")} | {"any"}
        for name in process_names():
            description = self.describe(name)
            self.assertEqual(description["process"], name)
            for port in description["inputs"] + description["outputs"]:
                self.assertIn(port["type"], types, name)
                self.assertIn(port["domain"], ("robot", "operator"), name)
                self.assertTrue(port["doc"], f"{name}: {port['channel']} has no doc")
            self.assertIn("HEALTH", [p["channel"] for p in description["outputs"]], name)

    def test_every_parameter_is_documented_and_named_as_one_word(self):
        for name in process_names():
            keys = []
            for param in self.describe(name)["params"]:
                self.assertRegex(param["key"], r"^[a-z][a-z0-9_]*$", name)
                self.assertTrue(param["doc"], f"{name}.{param['key']} has no doc")
                keys.append(param["key"])
            self.assertEqual(len(keys), len(set(keys)), f"{name} declares a parameter twice")

    def test_units_of_parameters_are_in_their_names(self):
        suffixes = {"s": "_s", "Hz": ("_hz", "_fps"), "px": "_px", "m": "_m", "deg": "_deg",
                    "rad": "_rad", "B/s": "_bytes_per_s"}
        for name in process_names():
            for param in self.describe(name)["params"]:
                suffix = suffixes.get(param.get("unit"))
                if suffix:
                    self.assertTrue(param["key"].endswith(suffix), f"{name}.{param['key']}")

    def test_a_readme_names_the_channels_of_its_process(self):
        for name, folder in process_folders().items():
            text = (folder / "README.md").read_text(encoding="utf-8")
            description = self.describe(name)
            ports = description["inputs"] + description["outputs"]
            # What link passes on is a parameter; health and snapshots are every process's.
            own = {p["channel"] for p in ports if p["type"] != "any"}
            for channel in own - {"HEALTH", "SNAPSHOT_REQUEST"}:
                self.assertIn(channel, text, f"{relative(folder)}/README.md")

    def test_no_process_listens_to_the_truth(self):
        self.assertIn("TRUTH_STATE", [p["channel"] for p in self.describe("sim")["outputs"]])
        for name in process_names():
            for port in self.describe(name)["inputs"]:
                self.assertFalse(port["channel"].startswith("TRUTH"),
                                 f"{name} listens to {port['channel']}")

    def test_channels_have_one_type(self):
        types = {}
        for name in process_names():
            description = self.describe(name)
            for port in description["inputs"] + description["outputs"]:
                if port["type"] != "any":
                    known = types.setdefault(port["channel"], port["type"])
                    self.assertEqual(known, port["type"], f"{name}: {port['channel']}")

    def test_help_names_every_parameter(self):
        for name in process_names():
            text = subprocess.run([program(name), "--help"], capture_output=True, text=True,
                                  check=True).stdout
            for param in self.describe(name)["params"]:
                self.assertIn(f"{param['key']} = ", text, name)


class SiteFiles(unittest.TestCase):
    def test_every_site_file_fits_the_programs(self):
        paths = sorted((ROOT / "deploy").glob("*.yaml"))
        self.assertTrue(paths)
        for path in paths:
            site = foresight_site.read_site(path)
            descriptions = {p.name: foresight_site.describe(site, p) for p in site.processes}
            self.assertEqual(foresight_site.unfed_inputs(site, descriptions), [], path.name)

    def test_a_site_file_fits_on_one_screen(self):
        for path in (ROOT / "deploy").glob("*.yaml"):
            self.assertLessEqual(len(path.read_text(encoding="utf-8").splitlines()), 50, path.name)

    def test_the_two_domains_use_different_ports(self):
        for path in (ROOT / "deploy").glob("*.yaml"):
            site = foresight_site.read_site(path)
            ports = [re.search(r":(\d+)\?", url)[1] for url in (site.robot_url, site.operator_url)]
            self.assertNotEqual(*ports, "groups on one port leak into each other")


if __name__ == "__main__":
    unittest.main()
