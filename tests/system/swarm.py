"""For the system tests: a deployed swarm, what it reports, sequences, logs.

A test runs in a network of its own (scripts/private_network), so the default URLs are free.
"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from foresight_bus import Stranger, with_health_texts  # noqa: E402  (the scripts are no package)
from foresight_paths import build_dir, program  # noqa: E402
from foresight_supervisor import OWNER, Supervisor, identity, is_running  # noqa: E402

ROBOT_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
OPERATOR_URL = "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=4194304"
URLS = ["--robot-url", ROBOT_URL, "--operator-url", OPERATOR_URL]


def wait_for(condition, timeout_s, what):
    """Polls condition() until it is true and returns it; fails with `what` (or what())."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.1)
    raise AssertionError(f"not within {timeout_s} s: {what() if callable(what) else what}")


def run(*command, timeout_s=120, **options):
    """A finished command with its text output."""
    return subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=timeout_s, check=False, **options)


def write_png(path, width_px, height_px, pixel):
    """A gray PNG; pixel(x, y) gives 0…255."""
    rows = b"".join(b"\0" + bytes(pixel(x, y) for x in range(width_px)) for y in range(height_px))

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    header = struct.pack(">IIBBBBB", width_px, height_px, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def write_tiny_sequence(folder, frames=20, rate_hz=10):
    """A sliding pattern, 96×72, in TUM layout: enough for all that needs no map."""
    (folder / "rgb").mkdir(parents=True)
    lines = []
    for i in range(frames):
        name = f"rgb/{i:04}.png"
        write_png(folder / name, 96, 72, lambda x, y, i=i: (5 * (x + i) ^ 7 * y) & 0xff)
        lines.append(f"{100 + i / rate_hz:.6f} {name}\n")
    (folder / "rgb.txt").write_text("# time file\n" + "".join(lines), encoding="ascii")
    (folder / "camera.yaml").write_text(
        "model: pinhole_radtan\nwidth: 96\nheight: 72\nfx: 80\nfy: 80\ncx: 47.5\ncy: 35.5\n"
        "k1: 0\nk2: 0\np1: 0\np2: 0\nk3: 0\n", encoding="ascii")
    return folder


def write_lab_sequence(folder):
    """Ten seconds along a desk and back, 320×240 at 10 Hz, made by code."""
    result = run(build_dir() / "bin" / "sim-sequence", folder, "--seconds", 10, "--fps", 10,
                 "--width", 320, "--trajectory", "return", "--no-depth")
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    return folder


class Monitor:
    """foresight-top beside the test: the newest report of every process."""

    def __init__(self):
        self.table = {}
        self.top = subprocess.Popen([program("top"), "--json", *URLS], stdout=subprocess.PIPE,
                                    text=True)
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        for line in self.top.stdout:
            self.table = json.loads(line)

    def process(self, name):
        """Its report, or None when it is silent."""
        for row in self.table.get("processes", []):
            if row["process"] == name and row["state"] != "GONE":
                return row
        return None

    def state(self, name):
        row = self.process(name)
        return row["state"] if row else "GONE"

    def port(self, name, channel, direction, domain="robot"):
        for port in (self.process(name) or {}).get("ports", []):
            if (port["channel"], port["direction"], port["domain"]) == (channel, direction, domain):
                return port
        return {"messages": 0, "rate_hz": 0.0, "rejected": 0, "skipped": 0}

    def summary(self):
        return "; ".join(f"{row['process']} {row['state']} {row['reason']}".strip()
                         for row in self.table.get("processes", [])) or "nobody reports"

    def close(self):
        self.top.terminate()
        self.top.wait(10)
        self.thread.join(10)
        self.top.stdout.close()


class Swarm:
    """A site with processes as YAML text, deployed with scripts/deploy from a folder of its own."""

    def __init__(self, processes, clock="wall"):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="foresight-"))
        self.site = self.folder / "site.yaml"
        self.site.write_text(
            f"robot_url: '{ROBOT_URL}'\noperator_url: '{OPERATOR_URL}'\n"
            f"clock: {clock}\nexternal: {{operator: [SLAM_COMMAND], robot: [PENDANT]}}\n"
            f"processes:\n{processes}", encoding="utf-8")
        self.run_dir = self.folder / "run"
        os.environ["XDG_DATA_HOME"] = str(self.folder)  # where slam keeps its map
        self.supervisor = Supervisor(self.run_dir)

    def move_run_dir(self, name):
        """Before it is up."""
        self.run_dir = self.folder / name
        self.supervisor = Supervisor(self.run_dir)

    def deploy(self, command, *arguments, **options):
        return run(ROOT / "scripts" / "deploy", command, self.site, "--run-dir", self.run_dir,
                   *arguments, **options)

    def up(self, *arguments):
        result = self.deploy("up", *arguments)
        if result.returncode != 0:
            raise AssertionError(f"up failed: {result.stdout}{result.stderr}{self.logs()}")
        return result.stdout

    def logs(self):
        return "".join(f"\n== {p.name}\n{p.read_text(errors='replace')[-2000:]}"
                       for p in sorted((self.run_dir / "logs").glob("*.log")))

    def pids(self):
        return {name: info["pid"] for name, info in self.supervisor.processes().items()}

    def close(self):
        self.supervisor.stop()
        shutil.rmtree(self.folder, ignore_errors=True)


def read_log(path):
    """[(channel, bytes)] of an LCM log; ends at a truncated event."""
    data = pathlib.Path(path).read_bytes()
    events, at = [], 0
    while at + 28 <= len(data):
        sync, _, _, channel_size, size = struct.unpack_from(">IqqII", data, at)
        end = at + 28 + channel_size + size
        if sync != 0xEDA1DA01 or end > len(data):
            break
        channel = data[at + 28:at + 28 + channel_size].decode("ascii")
        events.append((channel, data[at + 28 + channel_size:end]))
        at = end
    return events


def utimes(events, channel):
    """The utime field of every message on a channel: it follows the fingerprint."""
    return [struct.unpack_from(">q", data, 8)[0] for name, data in events if name == channel]


__all__ = ["Monitor", "OWNER", "ROBOT_URL", "ROOT", "Stranger", "Supervisor", "Swarm", "URLS",
           "build_dir", "identity", "is_running", "program", "read_log", "run", "utimes",
           "wait_for", "with_health_texts", "write_lab_sequence", "write_tiny_sequence"]
