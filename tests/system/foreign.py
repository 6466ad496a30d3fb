"""A stranger on the bus: sends messages of any content over UDP, as LCM does, without LCM."""
import itertools
import socket
import struct
import threading
import time

from swarm import OPERATOR_URL, ROBOT_URL

SHORT_MESSAGE = 0x4C433032  # "LC02"


def address_of(url):
    group, port = url.removeprefix("udpm://").partition("?")[0].split(":")
    return group, int(port)


class Stranger:
    """Publishes on one domain, and hears it."""

    def __init__(self, domain="robot"):
        self.address = address_of(ROBOT_URL if domain == "robot" else OPERATOR_URL)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.sequence = itertools.count()

    def send(self, channel, data):
        """In one datagram: up to 60 kB."""
        header = struct.pack(">II", SHORT_MESSAGE, next(self.sequence) & 0xFFFFFFFF)
        self.socket.sendto(header + channel.encode("ascii") + b"\0" + data, self.address)

    def hear(self, channel, timeout_s=20):
        """The bytes of the next message on a channel, if it is a short one."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
            ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            ear.bind(self.address)
            membership = socket.inet_aton(self.address[0]) + socket.inet_aton("0.0.0.0")
            ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            ear.settimeout(timeout_s)
            while True:
                datagram = ear.recv(65536)
                magic, = struct.unpack_from(">I", datagram)
                name, _, data = datagram[8:].partition(b"\0")
                if magic == SHORT_MESSAGE and name == channel.encode("ascii"):
                    return data

    def close(self):
        self.socket.close()


def lcm_string(data):
    return struct.pack(">i", len(data) + 1) + data + b"\0"


def with_health_texts(health, utime, process, reason):
    """A health_t with another time, name and reason."""
    def end_of_string(at):
        return at + 4 + struct.unpack_from(">i", health, at)[0]
    pid = end_of_string(16)  # after fingerprint and utime
    state = pid + 4
    rest = end_of_string(state + 1)
    return (health[:8] + struct.pack(">q", utime) + lcm_string(process) + health[pid:state + 1] + lcm_string(reason) +
            health[rest:])


class HealthSender:
    """Inside the `with`: a stranger's HEALTH, made of a real one, ten times a second."""

    def __init__(self, process, reason):
        self.stranger = Stranger()
        self.process, self.reason = process, reason
        self.done = threading.Event()
        self.thread = threading.Thread(target=self.work, daemon=True)

    def work(self):
        health = self.stranger.hear("HEALTH")
        while not self.done.wait(0.1):
            ahead = time.time_ns() // 1000 + 500_000  # newer than the real one's
            self.stranger.send("HEALTH",
                               with_health_texts(health, ahead, self.process, self.reason))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join(30)
        self.stranger.close()
