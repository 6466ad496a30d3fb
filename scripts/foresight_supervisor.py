"""Debian's supervisord for one deployed site: its configuration, its state, its end."""
import http.client
import json
import os
import pathlib
import shlex
import signal
import socket
import time
import xml.parsers.expat
import xmlrpc.client

from foresight_cli import Failure, captured
from foresight_paths import ROOT, out_dir
from foresight_site import SiteError

STOP_WAIT_S = 7        # SIGINT, then SIGKILL after so long
LONGEST_SOCKET = 90    # bytes of a path; the kernel's limit is 107 and supervisord appends its pid
COMPANION = "FORESIGHT_COMPANION"  # in the environment of what a script starts beside a site
COMPANION_BYTES = os.fsencode(COMPANION + "=")
AUTORESTART = {"always": "true", "on_failure": "unexpected", "never": "false"}
MARK = "FORESIGHT_RUN_DIR"
SUPERVISORD = ROOT / "scripts" / "foresight_supervisord.py"
# Keys of deployed.json: options of the last up, and the script that it was for.
RECORDED = {"set", "on", "robot_url", "operator_url", "force", "owner"}
OWNER = "FORESIGHT_OWNER"  # in the environment of scripts/deploy: who will take the site down


def run_dir_of(site_name):
    return out_dir() / "run" / site_name


def identity(pid):
    """A process's pid and start time: no other process will ever have both."""
    try:
        stat = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return None
    return f"{pid}:{stat.rpartition(')')[2].split()[19]}"


def is_owner_alive(owner):
    return is_running(owner.partition(":")[0]) and identity(owner.partition(":")[0]) == owner


class NoAnswer(Failure):
    """supervisord does not run, or hangs."""


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


def start_script(process, site):
    """What starts a process. All that people may have written (parameters, folders) stands here and
    not in supervisord's configuration, where %, ; and # mean something."""
    nice = ["nice", "-n", str(process.nice)] if process.nice else []
    return (f"cd {shlex.quote(str(ROOT))} || exit 69\n"
            f"exec {shlex.join(nice + process.command(site))}\n")


def exit_codes(process):
    """Those after which a process is not started again. A recording that was played to its end has
    ended, with 69 if some of its images were refused: it is not to be played for ever."""
    ends_by_itself = str(process.params.get("exit_at_end", "false")).lower() == "true"
    return "0,69" if ends_by_itself else "0"


def program_section(process, priority):
    return f"""
[program:{process.name}]
command=/bin/sh -c 'exec /bin/sh "${MARK}/start/{process.name}"'
priority={priority}
autostart=false
autorestart={AUTORESTART[process.restart]}
exitcodes={exit_codes(process)}
; ended within 3 s of its start, for whatever reason: tried again after 1, 2, 3 … s, then given up
startsecs=3
startretries=8
stopsignal=INT
stopwaitsecs={STOP_WAIT_S}
killasgroup=true
redirect_stderr=true
stdout_logfile=logs/{process.name}.log
stdout_logfile_maxbytes=5MB
stdout_logfile_backups=3
"""


def configuration(site):
    """supervisord's; relative paths are of the run directory, in which it is started."""
    text = """; Made by scripts/deploy: do not edit.
[supervisord]
logfile=supervisord.log
pidfile=supervisord.pid
childlogdir=logs

[unix_http_server]
file=supervisord.sock
chmod=0700

[rpcinterface:supervisor]
supervisor.rpcinterface_factory = supervisor.rpcinterface:make_main_rpcinterface
"""
    for priority, process in enumerate(site.processes):
        text += program_section(process, priority)
    return text


def environment_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return []


def command_of(entry):
    """The name of a process's program; entry is its folder in /proc."""
    try:
        command = (entry / "cmdline").read_bytes().split(b"\0")[0]
    except OSError:
        return "?"  # it has just ended
    return pathlib.Path(os.fsdecode(command)).name


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
        """A call of supervisord's interface; NoAnswer when it does not run."""
        connection = UnixConnection(str(self.socket))
        try:
            body = xmlrpc.client.dumps(arguments, f"supervisor.{method}").encode("utf-8")
            connection.request("POST", "/RPC2", body, {"Content-Type": "text/xml"})
            return xmlrpc.client.loads(connection.getresponse().read())[0][0]
        except (OSError, http.client.HTTPException, xml.parsers.expat.ExpatError) as error:
            raise NoAnswer(f"supervisord does not answer: {error} (see "
                           f"{self.run_dir}/supervisord.log)") from error
        finally:
            connection.close()

    def answers(self):
        try:
            return bool(self.call("getState"))
        except NoAnswer:
            return False

    def pid(self):
        """Of the running supervisord, or None."""
        try:
            pid = int((self.run_dir / "supervisord.pid").read_text(encoding="ascii"))
            command = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()
        except (OSError, ValueError):
            return None
        return pid if os.fsencode(self.run_dir) in command and is_running(pid) else None

    def record(self):
        """What scripts/deploy kept of the last up; nothing when there is nothing."""
        path = self.run_dir / "deployed.json"
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            return {}
        except ValueError:
            record = None
        if not isinstance(record, dict) or not RECORDED <= set(record):
            raise Failure(f"{path}: is damaged: remove it")
        return record

    def write_record(self, record):
        (self.run_dir / "deployed.json").write_text(json.dumps(record), encoding="utf-8")

    def is_up(self):
        """Whether anything of it runs, companions of scripts excepted."""
        return self.pid() is not None or bool(self.members(companions=False))

    def was_left(self):
        """Runs, but the script that would take it down is gone (it was killed)."""
        owner = self.record().get("owner")
        return bool(owner) and not is_owner_alive(owner) and self.is_up()

    def prepare(self, site):
        """Writes what supervisord reads."""
        try:
            for folder in ("logs", "start"):
                (self.run_dir / folder).mkdir(parents=True, exist_ok=True)
            for process in site.processes:
                (self.run_dir / "start" / process.name).write_text(start_script(process, site),
                                                                   encoding="utf-8")
            (self.run_dir / "supervisord.conf").write_text(configuration(site), encoding="utf-8")
        except OSError as error:
            raise Failure(f"run directory {self.run_dir} cannot be written: "
                          f"{error.strerror}") from error

    def start(self):
        """After prepare()."""
        result = captured(["/usr/bin/python3", SUPERVISORD, "-c", self.run_dir / "supervisord.conf"],
                          cwd=self.run_dir, env=os.environ | {MARK: str(self.run_dir)})
        if result.returncode != 0 or not poll(self.answers, 20):
            lines = (result.stdout + result.stderr).strip().splitlines() or ["it does not answer"]
            raise Failure(f"supervisord could not start: {lines[-1]} "
                          f"(see {self.run_dir}/supervisord.log)")

    def processes(self):
        """{name: supervisord's record of it}."""
        return {info["name"]: info for info in self.call("getAllProcessInfo")}

    def members(self, companions=True):
        """{pid: command} of all processes that were started for this run directory, supervised or
        not, supervisord itself excepted. Companions are those of a script that runs beside them."""
        mark = os.fsencode(f"{MARK}={self.run_dir}")
        own = {os.getpid(), self.pid()}
        found = {}
        for entry in pathlib.Path("/proc").iterdir():
            if not entry.name.isdigit() or int(entry.name) in own:
                continue
            environment = environment_of(entry.name)
            if mark not in environment or not is_running(entry.name):
                continue
            if companions or not any(e.startswith(COMPANION_BYTES) for e in environment):
                found[int(entry.name)] = command_of(entry)
        return found

    def stop(self):
        """Ends supervisord and every process of this run directory; their count."""
        count = len(self.members())
        pid = self.pid()
        if pid is not None:
            try:
                self.call("stopAllProcesses", False)  # all at once; shutdown alone takes turns
                poll(lambda: not self.members(companions=False), STOP_WAIT_S + 3)
                self.call("shutdown")
            except (NoAnswer, xmlrpc.client.Error):
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
