"""What the processes of a site say of themselves, read by programs of ours: a script cannot speak
LCM. Names and reasons come from the network and are made fit for a terminal."""
import json

from foresight_cli import captured, one_line
from foresight_paths import program

UNKNOWN = "?"  # in heard(): publishes, but does not report


def parse_reports(json_line):
    """{process: row} of what foresight-top --json prints."""
    reports = {}
    try:
        for row in json.loads(json_line)["processes"]:
            row |= {key: one_line(row.get(key, "")) for key in ("process", "state", "reason")}
            reports[row["process"]] = row
    except (ValueError, LookupError, TypeError, AttributeError):
        return {}
    return reports


def read_reports(urls=()):
    """{process: row}, or {} when nobody can listen; takes 2 s. `urls`: options of the program."""
    result = captured([program("top"), "--once", "--json", *urls])
    return parse_reports(result.stdout) if result.returncode == 0 else {}


def metric(reports, process, name):
    """A number that the process counts; 0 when it does not say."""
    return reports.get(process, {}).get("metrics", {}).get(name) or 0


def url_options(site):
    return ["--robot-url", site.robot_url, "--operator-url", site.operator_url]


def heard(site):
    """{(domain, process, pid)} of everybody who reports on the site's URLs, from this host or
    another; takes 1.3 s, longer where a slow world is simulated."""
    found = set()
    for line in captured([program("who"), *url_options(site)]).stdout.splitlines():
        domain, pid, process = line.split("\t")
        found.add((domain, one_line(process, 64), int(pid)))
    return found
