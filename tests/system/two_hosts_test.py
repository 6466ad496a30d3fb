#!/usr/bin/python3
"""docs/two_hosts.md, done as it says: robot's and operator's processes on two hosts (network
namespaces with a cable between them), the operator's domain across the cable with TTL 1."""
import contextlib
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from swarm import ROOT, build_dir, program, run, wait_for

PAGE = (ROOT / "docs" / "two_hosts.md").read_text(encoding="utf-8")
GROUP = "239.255.76.68"
SETTINGS = ["renderer.display=headless", "renderer.picture_width_px=160", "sim.camera_width_px=320",
            "sim.camera_rate_hz=10"]


def command_of(site):
    """The page's `scripts/deploy up …` for one of the hosts, with its URL."""
    line = re.search(rf"^scripts/deploy (up demo --on {site}.*)$", PAGE, re.M)[1]
    url = re.search(r"^URL='([^']+)'$", PAGE, re.M)[1]
    return [word.replace("\"$URL\"", url) for word in line.split()], url


class Host:
    """A network namespace with a loopback and one end of a cable; None: the test's own."""

    def __init__(self, folder, holder=None):
        self.folder = folder
        self.inside = ["nsenter", f"--net=/proc/{holder}/ns/net"] if holder else []
        self.environment = os.environ | {"FORESIGHT_OUT_DIR": str(folder / "out"),
                                         "XDG_DATA_HOME": str(folder / "data"),
                                         "FORESIGHT_BUILD_DIR": str(build_dir())}

    def run(self, *command, **options):
        return run(*self.inside, *command, env=self.environment, **options)

    def must(self, *command, **options):
        result = self.run(*command, **options)
        if result.returncode != 0:
            raise AssertionError(f"{command}: {result.stdout}{result.stderr}")
        return result.stdout

    def plug(self, device, address):
        """The end of the cable, with the routes of the page."""
        self.must("ip", "link", "set", "lo", "up", "multicast", "on")
        self.must("ip", "addr", "add", f"{address}/24", "dev", device)
        self.must("ip", "link", "set", device, "up")
        self.run("ip", "route", "add", "224.0.0.0/4", "dev", "lo")
        self.must("ip", "route", "add", f"{GROUP}/32", "dev", device)

    def up(self, site):
        words, _ = command_of(site)
        self.must(ROOT / "scripts" / "deploy", *words,
                  *(w for s in SETTINGS for w in ("--set", s)))

    def reports(self, url):
        text = self.run(program("top"), "--once", "--json", "--operator-url", url).stdout
        with contextlib.suppress(ValueError, LookupError):
            return {row["process"]: row for row in json.loads(text)["processes"]}
        return {}


class TwoHosts(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="foresight-hosts-")
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        holder = subprocess.Popen(["unshare", "--net", "sleep", "1000"])
        self.addCleanup(holder.wait)
        self.addCleanup(holder.kill)
        own = os.readlink("/proc/self/ns/net")
        wait_for(lambda: os.readlink(f"/proc/{holder.pid}/ns/net") != own, 10, "no namespace")
        self.robot, self.operator = Host(folder / "robot"), Host(folder / "operator", holder.pid)
        self.robot.must("ip", "link", "add", "cable", "type", "veth", "peer", "name", "cable",
                        "netns", holder.pid)
        self.robot.plug("cable", "10.9.8.1")
        self.operator.plug("cable", "10.9.8.2")
        self.addCleanup(lambda: [host.run(ROOT / "scripts" / "deploy", "down", "demo")
                                 for host in (self.operator, self.robot)])

    def test_the_view_is_predicted_across_the_cable(self):
        self.operator.up("operator")
        self.robot.up("robot")
        _, url = command_of("operator")

        def predicts():
            reports = self.operator.reports(url)
            self.last = reports
            renderer = reports.get("renderer", {})
            return renderer.get("state") == "OK" and \
                renderer["metrics"].get("textured_share", 0) > 0.3 and reports
        reports = wait_for(predicts, 180, lambda: {n: (r["state"], r["reason"])
                                                   for n, r in self.last.items()})
        self.assertEqual(reports["omni"]["metrics"]["followed"], 1)
        view = next(p for p in reports["renderer"]["ports"] if p["channel"] == "VIEW")
        self.assertGreater(view["messages"], 20)
        self.assertEqual(view["lost"], 0)
        # The robot's domain stays on the robot's host; its health comes through link.
        heard = self.operator.must(program("who"), "--operator-url", url).splitlines()
        self.assertEqual([line for line in heard if line.startswith("robot")], [])
        self.assertIn("slam", [line.split("\t")[2] for line in heard])


if __name__ == "__main__":
    unittest.main()
