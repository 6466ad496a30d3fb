"""Debian's supervisord for one deployed site: its configuration, its state, its end."""
import http.client
import os
import pathlib
import shlex
import signal
import socket
import subprocess
import time
import xml.parsers.expat
import xmlrpc.client

from foresight_paths import ROOT
from foresight_site import SiteError

STOP_WAIT_S = 7        # SIGINT, then SIGKILL after so long
LONGEST_SOCKET = 90    # bytes of a path; the kernel's limit is 107 and supervisord appends its pid
AUTORESTART = {"always": "true", "on_failure": "unexpected", "never": "false"}
MARK = "FORESIGHT_RUN_DIR"


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost", timeout=60)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)  # close() is the caller's, also after a failure


def poll(condition, timeout_s, period_s=0.05):
    """Waits until condition() is true; returns its last value."""
    end = time.monotonic() + timeout_s
    while True:
        value = condition()
        if value or time.monotonic() > end:
            return value
        time.sleep(period_s)


def program_section(process, site, run_dir, priority):
    escape = lambda text: text.replace("%", "%%")
    log = run_dir / "logs" / f"{process.name}.log"
    command = (["nice", "-n", str(process.nice)] if process.nice else []) + process.command(site)
    return f"""
[program:{process.name}]
command={escape(shlex.join(command))}
directory={escape(str(ROOT))}
environment={MARK}="{escape(str(run_dir))}"
priority={priority}
autostart=false
autorestart={AUTORESTART[process.restart]}
exitcodes=0
; ended within 3 s of its start, for whatever reason: tried again after 1, 2, 3 … s, then given up
startsecs=3
startretries=8
stopsignal=INT
stopwaitsecs={STOP_WAIT_S}
killasgroup=true
redirect_stderr=true
stdout_logfile={escape(str(log))}
stdout_logfile_maxbytes=5MB
stdout_logfile_backups=3
"""


def configuration(site, run_dir):
    path = lambda name: str(run_dir / name).replace("%", "%%")
    text = f"""; Made by scripts/deploy from {site.path}: do not edit.
[supervisord]
logfile={path("supervisord.log")}
pidfile={path("supervisord.pid")}
childlogdir={path("logs")}
directory={str(ROOT).replace("%", "%%")}

[unix_http_server]
file={path("supervisord.sock")}
chmod=0700

[rpcinterface:supervisor]
supervisor.rpcinterface_factory = supervisor.rpcinterface:make_main_rpcinterface
"""
    for priority, process in enumerate(site.processes):
        text += program_section(process, site, run_dir, priority)
    return text


def environment_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return []


def is_running(pid):
    """Exists, and is not just waiting for its parent to notice its end."""
    try:
        stat = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
        return stat.rpartition(")")[2].split()[0] not in ("Z", "X")
    except OSError:
        return False


class Supervisor:
    """The supervisord of a run directory, whether it runs or not."""

    def __init__(self, run_dir):
        self.run_dir = pathlib.Path(run_dir).absolute()
        self.socket = self.run_dir / "supervisord.sock"
        if len(os.fsencode(self.socket)) > LONGEST_SOCKET:
            raise SiteError(f"{self.run_dir}: too long for a Unix socket; give --run-dir DIR")

    def call(self, method, *arguments):
        """A call of supervisord's interface; OSError when it does not run."""
        connection = UnixConnection(str(self.socket))
        try:
            body = xmlrpc.client.dumps(arguments, f"supervisor.{method}").encode("utf-8")
            connection.request("POST", "/RPC2", body, {"Content-Type": "text/xml"})
            return xmlrpc.client.loads(connection.getresponse().read())[0][0]
        finally:
            connection.close()

    def answers(self):
        try:
            return bool(self.call("getState"))
        except (OSError, http.client.HTTPException, xml.parsers.expat.ExpatError):
            return False

    def pid(self):
        """Of the running supervisord, or None."""
        try:
            pid = int((self.run_dir / "supervisord.pid").read_text(encoding="ascii"))
            command = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()
        except (OSError, ValueError):
            return None
        return pid if os.fsencode(self.run_dir) in command and is_running(pid) else None

    def start(self, site):
        (self.run_dir / "logs").mkdir(parents=True, exist_ok=True)
        path = self.run_dir / "supervisord.conf"
        path.write_text(configuration(site, self.run_dir), encoding="utf-8")
        result = subprocess.run(["supervisord", "-c", path], capture_output=True, text=True,
                                check=False)
        if result.returncode != 0 or not poll(self.answers, 20):
            lines = (result.stdout + result.stderr).strip().splitlines() or ["it does not answer"]
            raise SiteError(f"supervisord could not start: {lines[-1]} "
                            f"(see {self.run_dir}/supervisord.log)")

    def processes(self):
        """{name: supervisord's record of it}."""
        return {info["name"]: info for info in self.call("getAllProcessInfo")}

    def members(self):
        """{pid: command} of all processes started from this run directory, supervised or not."""
        mark = os.fsencode(f"{MARK}={self.run_dir}")
        found = {}
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit() and mark in environment_of(entry.name) and is_running(
                    entry.name):
                command = (entry / "cmdline").read_bytes().split(b"\0")[0]
                found[int(entry.name)] = pathlib.Path(os.fsdecode(command)).name
        return found

    def stop(self):
        """Ends supervisord and every process of this run directory; their count."""
        count = len(self.members())
        pid = self.pid()
        if pid is not None:
            try:
                self.call("stopAllProcesses", False)  # all at once; shutdown alone takes turns
                poll(lambda: not self.members(), STOP_WAIT_S + 3)
                self.call("shutdown")
            except (OSError, http.client.HTTPException, xmlrpc.client.Error,
                    xml.parsers.expat.ExpatError):
                self.signal([pid], signal.SIGTERM)
            poll(lambda: not is_running(pid), STOP_WAIT_S * 3)
            if is_running(pid):
                self.signal([pid], signal.SIGKILL)
        for number in (signal.SIGINT, signal.SIGKILL):
            self.signal(self.members(), number)
            if poll(lambda: not self.members(), STOP_WAIT_S):
                break
        for name in ("supervisord.sock", "supervisord.pid"):
            (self.run_dir / name).unlink(missing_ok=True)
        return count

    @staticmethod
    def signal(pids, number):
        for pid in pids:
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                pass  # it has just ended by itself
