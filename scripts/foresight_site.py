"""Site files (deploy/*.yaml): read strictly, checked against what the programs say of themselves.

A site file lists the two LCM domains and the processes, on one screen. Anything it does not
understand is refused with one line that names file, key and value.
"""
import dataclasses
import datetime
import pathlib
import re
import reprlib

import yaml

from foresight_cli import EXIT_CONFIG, Failure, captured, one_line
from foresight_paths import ROOT, program

SITE_KEYS = {"robot_url", "operator_url", "clock", "arm_file", "external", "processes"}
PROCESS_KEYS = {"program", "site", "clock", "start", "restart", "nice", "params_file", "params"}
# Programs with a parameter arm_file: the site names it once, and each of them is handed it.
ARM_PROGRAMS = ("wam_controller", "sim", "omni", "calibrator", "renderer")
LARGEST_NICE = 19
CHOICES = {"site": ("robot", "operator"), "clock": ("wall", "published"),
           "start": ("first", "last"),
           "restart": ("always", "on_failure", "never")}
DOMAINS = ("robot", "operator")
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,62}")  # of processes, programs and channels
# What the YAML library raises for texts that are none, besides its own error.
NOT_YAML = (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, RecursionError, TypeError,
            ValueError)


class SiteError(Failure):
    """One line for people."""

    def __init__(self, line):
        super().__init__(line, EXIT_CONFIG)


@dataclasses.dataclass
class Process:
    name: str
    program: str
    site: str
    clock: str
    start: str
    restart: str
    nice: int
    params_file: str
    params: dict

    def command(self, site):
        """The program with its whole command line."""
        line = [str(program(self.program)), "--name", self.name,
                "--robot-url", site.robot_url, "--operator-url", site.operator_url, "--clock", self.clock]
        if self.params_file:
            line += ["--params", self.params_file]
        arm = {"arm_file": site.arm_file} if site.arm_file and self.program in ARM_PROGRAMS else {}
        for key, value in (arm | self.params).items():
            line += ["--set", f"{key}={value}"]
        return line


@dataclasses.dataclass
class Site:
    path: pathlib.Path
    robot_url: str
    operator_url: str
    external: dict  # domain -> channels that tools and people publish
    processes: list
    arm_file: str = ""  # of the arm that the site is about; empty: each program's default
    elsewhere: list = dataclasses.field(default_factory=list)  # those that another host runs

    def find(self, name):
        for process in self.processes:
            if process.name == name:
                return process
        raise SiteError(f"{self.path}: there is no process '{name}'; there are: "
                        f"{', '.join(p.name for p in self.processes)}")


class StrictLoader(yaml.SafeLoader):
    """Refuses a key that is given twice, which YAML readers usually overlook."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise SiteError(f"{self.name}: {shown(key)}: given twice")
        return super().construct_mapping(node, deep)


def find_site_file(name):
    """deploy/NAME.yaml, or the file itself."""
    for path in (ROOT / "deploy" / f"{name}.yaml", pathlib.Path(name)):
        if path.is_file():
            return path
    known = ", ".join(sorted(p.stem for p in (ROOT / "deploy").glob("*.yaml")))
    raise SiteError(f"there is no site '{name}'; there are: {known}, or give a file")


def shown(value):
    """A value of any kind and size, in few words."""
    if value is None:
        return "nothing"
    try:
        return f"'{one_line(value if isinstance(value, str) else reprlib.repr(value), 60)}'"
    except ValueError:
        return "a huge number"  # Python refuses to print some


def require_map(value, where):
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise SiteError(f"{where}: must be a map of 'key: value', is {shown(value)}")
    return value


def require_text(value, where, pattern=None):
    """A text that can stand on a command line, and as a whole match the pattern."""
    if not isinstance(value, str) or not value:
        raise SiteError(f"{where}: must be a text, is {shown(value)}")
    if not all(c.isprintable() for c in value):
        raise SiteError(f"{where}: has characters that cannot be printed: {shown(value)}")
    if pattern and not pattern.fullmatch(value):
        raise SiteError(f"{where}: {shown(value)} must be of letters, digits, '_', '-' and '.'")
    return value


def refuse_unknown(entries, known, where):
    for key in entries:
        if key not in known:
            raise SiteError(f"{where}{one_line(key, 60)}: unknown key; "
                            f"known: {', '.join(sorted(known))}")


def choose(value, key, where):
    if value not in CHOICES[key]:
        raise SiteError(f"{where}{key}: {shown(value)} is not one of {', '.join(CHOICES[key])}")
    return value


def parameter_text(value, where):
    """As a process takes it behind KEY=: a list is its elements, separated by blanks."""
    if isinstance(value, list):
        texts = [parameter_text(element, where) for element in value
                 if not isinstance(element, list)]
        if len(texts) < len(value) or any(re.search(r"[\s,]|^$", text) for text in texts):
            raise SiteError(f"{where}: must be a list of words or numbers, is {shown(value)}")
        return " ".join(texts)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) < 10**18:
        return str(value)
    if isinstance(value, (float, datetime.date)):
        return str(value)
    if value == "":
        return value
    if not isinstance(value, str):
        raise SiteError(f"{where}: must be one value or a list of them, is {shown(value)}")
    return require_text(value, where)


def read_params(entries, where):
    params = {}
    for key, value in require_map(entries, where).items():
        key = require_text(key, f"{where}: a key", NAME)
        params[key] = parameter_text(value, f"{where}.{key}")
    return params


def read_external(root, path):
    """{domain: [channel]} that tools and people publish."""
    entries = require_map(root.get("external"), f"{path}: external")
    refuse_unknown(entries, DOMAINS, f"{path}: external.")
    external = {}
    for domain, channels in entries.items():
        where = f"{path}: external.{domain}"
        if channels is not None and not isinstance(channels, list):
            raise SiteError(f"{where}: must be a list of channels, is {shown(channels)}")
        external[domain] = [require_text(channel, where, NAME) for channel in channels or []]
    return external


def read_process(name, entry, path, clock):
    require_text(name, f"{path}: processes: a name", NAME)
    where = f"{path}: processes.{name}."
    entry = require_map(entry, where[:-1])
    refuse_unknown(entry, PROCESS_KEYS, where)
    values = {"site": "robot", "clock": clock, "start": "first", "restart": "on_failure",
              **entry}
    for key in CHOICES:
        choose(values[key], key, where)
    nice = entry.get("nice", 0)
    if isinstance(nice, bool) or not isinstance(nice, int) or not 0 <= nice <= LARGEST_NICE:
        raise SiteError(f"{where}nice: must be a whole number from 0 to {LARGEST_NICE}, "
                        f"is {shown(nice)}")
    params_file = entry.get("params_file")
    if params_file is not None:
        require_text(params_file, f"{where}params_file")
        params_file = str((path.parent / params_file).resolve())
    return Process(name, require_text(entry.get("program", name), f"{where}program", NAME),
                   values["site"], values["clock"], values["start"], values["restart"], nice,
                   params_file or "", read_params(entry.get("params"), f"{where}params"))


def load_yaml(path):
    try:
        with open(path, encoding="utf-8") as file:
            return yaml.load(file, StrictLoader)
    except OSError as error:
        raise SiteError(f"{path}: {error.strerror}") from error
    except NOT_YAML as error:
        raise SiteError(f"{path}: not YAML: {error}") from error


def read_site(path):
    """Reads a site file; raises SiteError."""
    path = pathlib.Path(path)
    root = require_map(load_yaml(path), str(path))
    refuse_unknown(root, SITE_KEYS, f"{path}: ")
    for key in ("robot_url", "operator_url"):
        if not root.get(key):
            raise SiteError(f"{path}: {key}: missing, e.g. udpm://239.255.76.67:7667?ttl=0")
        require_text(root[key], f"{path}: {key}")
    clock = choose(root.get("clock", "wall"), "clock", f"{path}: ")
    entries = require_map(root.get("processes"), f"{path}: processes")
    processes = [read_process(name, entry, path, clock) for name, entry in entries.items()]
    if not processes:
        raise SiteError(f"{path}: processes: missing")
    arm_file = root.get("arm_file", "")
    if "arm_file" in root:
        require_text(arm_file, f"{path}: arm_file")
    return Site(path, root["robot_url"], root["operator_url"], read_external(root, path), processes,
                arm_file)


def apply_assignment(site, text):
    """--set PROCESS.KEY=VALUE, or arm_file=FILE of the whole site."""
    target, equals, value = text.partition("=")
    if equals and target == "arm_file":
        site.arm_file = require_text(value, "--set arm_file")
        return
    name, dot, key = target.partition(".")
    if not equals or not dot or not key:
        raise SiteError(f"--set {text}: must be PROCESS.KEY=VALUE, or arm_file=FILE")
    params = site.find(name).params
    params[key] = parameter_text(value, f"--set {name}.{key}")


def describe(site, process):
    """What the program says of itself with these parameters; raises SiteError when it refuses."""
    path = program(process.program)
    if not path.exists():
        raise SiteError(f"{site.path}: {process.name}: there is no program {path} "
                        f"(scripts/build builds everything)")
    result = captured(process.command(site) + ["--describe"])
    if result.returncode != 0:
        lines = result.stderr.strip().splitlines() or [f"exit code {result.returncode}"]
        raise SiteError(f"{site.path}: {lines[-1]}")
    try:
        return yaml.safe_load(result.stdout)
    except NOT_YAML as error:
        raise SiteError(f"{site.path}: {process.name}: {path} --describe is not YAML: "
                        f"{error}") from error


def unfed_inputs(site, descriptions):
    """One line for each subscription that nobody publishes, unless it is optional, or that is
    published as another type."""
    published = {(domain, channel): "any" for domain in site.external
                 for channel in site.external[domain]}
    for description in descriptions.values():
        for port in description["outputs"]:
            key = (port["domain"], port["channel"])
            if published.get(key, "any") == "any":
                published[key] = port["type"]
    problems = []
    for name, description in descriptions.items():
        for port in description["inputs"]:
            source = published.get((port["domain"], port["channel"]))
            what = f"{name} listens to {port['channel']} ({port['domain']} domain)"
            if source is None and not port.get("optional"):
                problems.append(f"{what}, which nobody publishes")
            elif source and "any" not in (source, port["type"]) and source != port["type"]:
                problems.append(f"{what} as {port['type']}, which is published as {source}")
    return problems
