"""A stranger who reports on the robot's domain."""
import threading
import time

from swarm import ROBOT_URL, Stranger, with_health_texts


class HealthSender:
    """Inside the `with`: HEALTH with any bytes as texts, made of a real one, ten times a second."""

    def __init__(self, process, reason):
        self.stranger = Stranger(ROBOT_URL)
        self.process, self.reason = process, reason
        self.done = threading.Event()
        self.thread = threading.Thread(target=self.work, daemon=True)

    def work(self):
        _, health = self.stranger.hear(["HEALTH"], 20)
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
