"""What scripts/demo starts beside itself, and that nothing of it outlives the script: children of
its own, recorders, a deployed site. Whatever ends the script (Ctrl-C, SIGTERM, SIGHUP, an error)
ends these first; should it be killed, the recorders end by themselves and the next `deploy up` or
`deploy down` of the site ends the rest."""
import contextlib
import os
import signal
import subprocess
import sys

from foresight_cli import Failure, one_line, uninterrupted
from foresight_paths import ROOT
from foresight_supervisor import COMPANION, MARK, OWNER, Supervisor, identity, run_dir_of

END_WAIT_S = 60  # deploy takes its processes down when it is told to end


def end_group(child):
    """Ends a child and what it has started; returns when it is gone."""
    for number, wait_s in ((signal.SIGTERM, END_WAIT_S), (signal.SIGKILL, None)):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(wait_s)
            return


def run_child(command, **options):
    """Like subprocess.run(check=True), in a process group of its own: Ctrl-C reaches this script
    alone, which then ends the child as a whole."""
    environment = os.environ | {OWNER: identity(os.getpid())}
    with subprocess.Popen([str(word) for word in command], process_group=0, env=environment,
                          stdin=subprocess.DEVNULL, **options) as child:
        try:
            output, complaint = child.communicate()
        except BaseException:
            with uninterrupted():
                end_group(child)
            raise
    if child.returncode != 0:
        raise subprocess.CalledProcessError(child.returncode, command, output, complaint)


def enter_own_network(mark, *targets):
    """Builds these and begins this script anew in a network of its own, unless the environment
    variable `mark` says that it is there."""
    if mark in os.environ:
        return
    subprocess.run([ROOT / "scripts" / "build", *targets], check=True)
    private_network = ROOT / "scripts" / "private_network"
    os.execve(private_network, [private_network, *sys.argv], os.environ | {mark: "1"})


def refuse_if_up(site):
    """Before anything of an earlier session is overwritten: raises Failure."""
    supervisor = Supervisor(run_dir_of(site))
    if supervisor.is_up() and not supervisor.was_left():
        raise Failure(f"{site} is up already: scripts/deploy down {site}")


@contextlib.contextmanager
def deployed(site, *options):
    """A site that is up inside the `with`, and down after it, whatever happened."""
    try:
        run_child([ROOT / "scripts" / "deploy", "up", site, *options])
        yield
    finally:
        with uninterrupted(), contextlib.suppress(subprocess.CalledProcessError):
            run_child([ROOT / "scripts" / "deploy", "down", site])


class Recorder:
    """scripts/record in the background, for one domain of a site."""

    def __init__(self, site, domain, channels, log):
        self.log = log
        self.words = log.with_suffix(".record.txt")
        log.unlink(missing_ok=True)
        environment = os.environ | {MARK: str(run_dir_of(site)), COMPANION: "recorder"}
        with open(self.words, "wb") as words:
            # It ends with this script, however that ends.
            self.process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "INT", ROOT / "scripts" / "record", site, "--domain",
                 domain, "--channel", channels, log],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=words,
                env=environment, process_group=0)

    def complaint(self):
        """Why it has failed, or None: it records, or was told to end."""
        if self.process.poll() in (None, 0):
            return None
        lines = self.words.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return one_line(f"{self.log} is not recorded any more: {(lines or ['it has ended'])[-1]}")

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Recording:
    """Recorders of several domains."""

    def __init__(self, site, channels_by_domain, folder):
        self.site = site
        self.channels_by_domain = channels_by_domain
        self.folder = folder
        self.recorders = []
        self.complaints = []

    def __enter__(self):
        try:
            for domain, channels in self.channels_by_domain.items():
                self.recorders.append(Recorder(self.site, domain, channels,
                                               self.folder / f"{domain}.lcmlog"))
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        with uninterrupted():
            self.new_complaints()  # of one that ended since the last look
            for recorder in self.recorders:
                recorder.stop()

    def new_complaints(self):
        """What recorders have said at their end, each once."""
        new = [c for c in (r.complaint() for r in self.recorders) if c and c not in self.complaints]
        self.complaints += new
        return new

    def require_whole(self):
        """Raises Failure when a recorder ended before its time."""
        if self.complaints:
            raise Failure("; ".join(self.complaints))
