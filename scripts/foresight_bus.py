"""A stranger on an LCM domain: sends messages of any content and hears the small ones, over UDP and
without LCM, for tests and for scripts/fault_report."""
import dataclasses
import itertools
import re
import select
import socket
import struct
import time

SHORT_MESSAGE = 0x4C433032  # "LC02": in one datagram
STATES = ("STARTING", "OK", "WAITING", "DEGRADED", "FAILED", "DONE")


def address_of(url):
    """(group, port) of an LCM URL."""
    group, port = re.match(r"udpm://([0-9.]+):(\d+)", url).groups()
    return group, int(port)


class Stranger:
    """Publishes on one domain, and hears it."""

    def __init__(self, url):
        self.address = address_of(url)
        self.mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.mouth.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.ear.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.ear.bind(self.address)
        membership = socket.inet_aton(self.address[0]) + socket.inet_aton("0.0.0.0")
        self.ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self.sequence = itertools.count()

    def send_datagram(self, datagram):
        self.mouth.sendto(datagram, self.address)

    def send(self, channel, data):
        """A message of up to 60 kB."""
        header = struct.pack(">II", SHORT_MESSAGE, next(self.sequence) & 0xFFFFFFFF)
        self.send_datagram(header + channel.encode("ascii") + b"\0" + data)

    def hear(self, channels, timeout_s):
        """(channel, data) of the next message on one of these channels, or None."""
        end = time.monotonic() + timeout_s
        names = {channel.encode("ascii"): channel for channel in channels}
        while (left := end - time.monotonic()) > 0:
            if not select.select([self.ear], [], [], left)[0]:
                break
            datagram = self.ear.recv(65536)
            if len(datagram) < 9 or struct.unpack_from(">I", datagram)[0] != SHORT_MESSAGE:
                continue
            name, _, data = datagram[8:].partition(b"\0")
            if name in names:
                return names[name], data
        return None

    def close(self):
        self.mouth.close()
        self.ear.close()


@dataclasses.dataclass
class Health:
    """The head of a health_t."""
    utime: int
    process: str
    pid: int
    state: str
    reason: str


def read_string(data, at):
    """(bytes, where the next field begins) of an LCM string."""
    size, = struct.unpack_from(">i", data, at)
    if not 1 <= size <= len(data) - at - 4:
        raise ValueError("a string is longer than its message")
    return data[at + 4:at + 3 + size], at + 4 + size


def parse_health(data):
    """Raises ValueError or struct.error when it is none."""
    process, at = read_string(data, 16)
    pid, state = struct.unpack_from(">ib", data, at)
    reason, _ = read_string(data, at + 5)
    return Health(struct.unpack_from(">q", data, 8)[0], process.decode("utf-8", "replace"), pid,
                  STATES[state] if 0 <= state < len(STATES) else str(state),
                  reason.decode("utf-8", "replace"))


def lcm_string(data):
    return struct.pack(">i", len(data) + 1) + data + b"\0"


def with_health_texts(health, utime, process, reason):
    """The bytes of a health_t with another time, name and reason."""
    _, pid = read_string(health, 16)
    _, rest = read_string(health, pid + 5)
    return (health[:8] + struct.pack(">q", utime) + lcm_string(process) + health[pid:pid + 5] +
            lcm_string(reason) + health[rest:])
