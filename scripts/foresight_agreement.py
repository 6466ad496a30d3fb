"""Parameters that different processes must have alike: nobody moves as he is predicted to move when
the two assume different limits, and nothing in a message says so."""
import os

from foresight_cli import EXIT_CONFIG, Failure
from foresight_paths import ROOT
from foresight_site import ARM_PROGRAMS

# The renderer predicts the controller's profile.
PREDICTED = ("velocity_limit_rad_per_s", "acceleration_limit_rad_per_s2", "limit_margin_rad",
             "command_timeout_s")


class Parameters:
    """Of the site's processes, as the programs read them."""

    def __init__(self, site, descriptions):
        self.path = site.path
        self.of = {name: {p["key"]: p["value"] for p in description["params"]}
                   for name, description in descriptions.items()}
        self.programs = {p.name: p.program for p in site.processes + site.elsewhere}

    def running(self, *programs):
        return [name for name in self.of if self.programs[name] in programs]


def comparable(key, value):
    """What two spellings of one value have in common."""
    if key == "arm_file":
        return os.path.realpath(ROOT / str(value))
    try:
        return float(value)
    except ValueError:
        return str(value)


def differing(parameters, key, names):
    """A line when the processes do not have the same value."""
    values = {name: parameters.of[name][key] for name in names if key in parameters.of[name]}
    if len({comparable(key, value) for value in values.values()}) < 2:
        return []
    listed = ", ".join(f"{name} {value}" for name, value in values.items())
    return [f"{key} must be the same: {listed}"]


def uses_the_arm(parameters, name):
    """A renderer that follows camera poses knows no arm."""
    return parameters.of[name].get("predict") != "camera_pose"


def too_fast(parameters):
    """Commands that the controller cannot follow make the arm lag behind the hand."""
    lines = []
    for controller in parameters.running("wam_controller"):
        limit = parameters.of[controller]["velocity_limit_rad_per_s"]
        for omni in parameters.running("omni"):
            fastest = parameters.of[omni]["max_velocity_rad_per_s"]
            if float(fastest) > float(limit):
                lines.append(f"max_velocity_rad_per_s of {omni} ({fastest}) exceeds "
                             f"velocity_limit_rad_per_s of {controller} ({limit})")
    return lines


def disagreements(site, descriptions):
    """One line for each parameter that must agree and does not."""
    parameters = Parameters(site, descriptions)
    with_arm = [name for name in parameters.running(*ARM_PROGRAMS)
                if uses_the_arm(parameters, name)]
    lines = differing(parameters, "arm_file", with_arm)
    predicting = [name for name in parameters.running("renderer")
                  if parameters.of[name].get("predict") == "robot"]
    for key in PREDICTED:
        if predicting:
            lines += differing(parameters, key, parameters.running("wam_controller") + predicting)
    return lines + too_fast(parameters)


def require_agreement(site, descriptions):
    """Raises Failure with one line."""
    if lines := disagreements(site, descriptions):
        raise Failure(f"{site.path}: " + "; ".join(lines), EXIT_CONFIG)
