"""Site files (deploy/*.yaml): read strictly, checked against what the programs say of themselves.

A site file lists the two LCM domains and the processes, on one screen. Anything it does not
understand is refused with one line that names file, key and value.
"""
import dataclasses
import pathlib
import subprocess

import yaml

from foresight_paths import ROOT, program

SITE_KEYS = {"robot_url", "operator_url", "clock", "external", "processes"}
PROCESS_KEYS = {"program", "site", "clock", "start", "restart", "nice", "params_file", "params"}
LARGEST_NICE = 19
CHOICES = {"site": ("robot", "operator"), "clock": ("wall", "published"),
           "start": ("first", "last"),
           "restart": ("always", "on_failure", "never")}
DOMAINS = ("robot", "operator")


class SiteError(Exception):
    """One line for people."""


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
        for key, value in self.params.items():
            line += ["--set", f"{key}={value}"]
        return line


@dataclasses.dataclass
class Site:
    path: pathlib.Path
    robot_url: str
    operator_url: str
    external: dict  # domain -> channels that tools and people publish
    processes: list

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
                raise SiteError(f"{self.name}: {key}: given twice")
        return super().construct_mapping(node, deep)


def find_site_file(name):
    """deploy/NAME.yaml, or the file itself."""
    for path in (ROOT / "deploy" / f"{name}.yaml", pathlib.Path(name)):
        if path.is_file():
            return path
    known = ", ".join(sorted(p.stem for p in (ROOT / "deploy").glob("*.yaml")))
    raise SiteError(f"there is no site '{name}'; there are: {known}, or give a file")


def require_map(value, where):
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise SiteError(f"{where}: must be a map of 'key: value', is '{value}'")
    return value


def refuse_unknown(entries, known, where):
    for key in entries:
        if key not in known:
            raise SiteError(f"{where}{key}: unknown key; known: {', '.join(sorted(known))}")


def parameter_text(value, where):
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None or isinstance(value, (dict, list)):
        raise SiteError(f"{where}: must be one value, is '{value}'")
    return str(value)


def read_process(name, entry, path, clock):
    where = f"{path}: processes.{name}."
    entry = require_map(entry, where[:-1])
    refuse_unknown(entry, PROCESS_KEYS, where)
    values = {"site": "robot", "clock": clock, "start": "first", "restart": "on_failure",
              **entry}
    for key, choices in CHOICES.items():
        if values[key] not in choices:
            raise SiteError(f"{where}{key}: '{values[key]}' is not one of {', '.join(choices)}")
    nice = entry.get("nice", 0)
    if isinstance(nice, bool) or not isinstance(nice, int) or not 0 <= nice <= LARGEST_NICE:
        raise SiteError(f"{where}nice: must be a whole number from 0 to {LARGEST_NICE}, "
                        f"is '{nice}'")
    params_file = entry.get("params_file") or ""
    if params_file:
        params_file = str((path.parent / params_file).resolve())
    params = {key: parameter_text(value, f"{where}params.{key}")
              for key, value in require_map(entry.get("params"), f"{where}params").items()}
    return Process(name, entry.get("program", name), values["site"], values["clock"],
                   values["start"], values["restart"], nice, params_file, params)


def read_site(path):
    """Reads a site file; raises SiteError."""
    path = pathlib.Path(path)
    try:
        with open(path, encoding="utf-8") as file:
            root = require_map(yaml.load(file, StrictLoader), str(path))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise SiteError(f"{path}: not YAML: {' '.join(str(error).split())}") from error
    except OSError as error:
        raise SiteError(f"{path}: {error.strerror}") from error
    refuse_unknown(root, SITE_KEYS, f"{path}: ")
    for key in ("robot_url", "operator_url"):
        if not isinstance(root.get(key), str):
            raise SiteError(f"{path}: {key}: missing, e.g. udpm://239.255.76.67:7667?ttl=0")
    external = require_map(root.get("external"), f"{path}: external")
    refuse_unknown(external, DOMAINS, f"{path}: external.")
    clock = root.get("clock", "wall")
    if clock not in CHOICES["clock"]:
        raise SiteError(f"{path}: clock: '{clock}' is not one of {', '.join(CHOICES['clock'])}")
    processes = [read_process(name, entry, path, clock)
                 for name, entry in require_map(root.get("processes"), f"{path}: processes").items()]
    if not processes:
        raise SiteError(f"{path}: processes: missing")
    return Site(path, root["robot_url"], root["operator_url"], external, processes)


def apply_assignment(site, text):
    """--set PROCESS.KEY=VALUE."""
    target, equals, value = text.partition("=")
    name, dot, key = target.partition(".")
    if not equals or not dot or not key:
        raise SiteError(f"--set {text}: must be PROCESS.KEY=VALUE")
    site.find(name).params[key] = value


def describe(site, process):
    """What the program says of itself with these parameters; raises SiteError when it refuses."""
    path = program(process.program)
    if not path.exists():
        raise SiteError(f"{site.path}: {process.name}: there is no program {path} "
                        f"(scripts/build builds everything)")
    result = subprocess.run(process.command(site) + ["--describe"], capture_output=True, text=True,
                            check=False)
    if result.returncode != 0:
        lines = result.stderr.strip().splitlines() or [f"exit code {result.returncode}"]
        raise SiteError(f"{site.path}: {lines[-1]}")
    return yaml.safe_load(result.stdout)


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
