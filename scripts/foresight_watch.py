"""Who of a deployed site is well, heard at the moment it is said: for scripts that throw faults."""
import struct
import time

from foresight_bus import Stranger, parse_health

SETTLE_S = 2      # all must be well for so long
GOOD = ("OK", "DONE")


class Watcher:
    """What every process says of itself, at the moment it says so."""

    def __init__(self, site):
        self.strangers = {"robot": Stranger(site.robot_url),
                          "operator": Stranger(site.operator_url)}
        self.homes = {p.name: p.site for p in site.processes}
        self.newest = {}  # process: (time heard, Health)
        self.history = []  # (time heard, Health) at every change

    def listen(self, duration_s):
        """Takes in what is said for so long."""
        end = time.monotonic() + duration_s
        while (left := end - time.monotonic()) > 0:
            for domain, stranger in self.strangers.items():
                if message := stranger.hear(["HEALTH"], min(left, 0.02)):
                    self.take(domain, message[1])

    def take(self, domain, data):
        try:
            health = parse_health(data)
        except (ValueError, struct.error):
            return
        if self.homes.get(health.process) != domain:
            return
        now = time.monotonic()
        before = self.newest.get(health.process)
        self.newest[health.process] = (now, health)
        if before is None or (before[1].pid, before[1].state) != (health.pid, health.state):
            self.history.append((now, health))

    def unwell(self):
        """Who is silent or not well."""
        now = time.monotonic()
        return sorted(name for name in self.homes
                      if name not in self.newest or now - self.newest[name][0] > 6 or
                      self.newest[name][1].state not in GOOD)

    def wait_until_well(self, timeout_s, fault_at=None):
        """When the last one became well, for SETTLE_S; None when that does not come."""
        end, well_since = time.monotonic() + timeout_s, None
        while time.monotonic() < end:
            self.listen(0.1)
            if self.unwell():
                well_since = None
                continue
            well_since = well_since or time.monotonic()
            if time.monotonic() - well_since >= SETTLE_S:
                changes = [t for t, _ in self.history if fault_at is None or t > fault_at]
                return max(changes, default=fault_at or well_since)
        return None
