"""For the tests that kill each process of a deployed swarm in turn."""
import os
import signal
import time
import unittest

from swarm import Monitor, Swarm, wait_for

RECOVERY_S = 90  # generous: slam may have to find its way in a new map, on a loaded machine


class RecoveryCase(unittest.TestCase):
    """A deployed swarm; WELL are the processes that must be OK, besides slam and renderer."""

    WELL = ()

    @classmethod
    def deploy(cls, processes, clock="wall"):
        cls.swarm = Swarm(processes, clock)
        cls.addClassCleanup(cls.swarm.close)
        cls.swarm.up()
        cls.monitor = Monitor()
        cls.addClassCleanup(cls.monitor.close)

    def wait(self, condition, what):
        wait_for(condition, RECOVERY_S,
                 lambda: f"{what}: {self.monitor.summary()}{self.swarm.logs()}")

    def messages(self, name, channel, domain="robot"):
        return self.monitor.port(name, channel, "in", domain)["messages"]

    def wait_until_all_work(self):
        self.wait(lambda: self.monitor.state("slam") == "OK", "slam tracks")
        self.wait(lambda: self.monitor.state("renderer") == "OK", "the renderer shows a prediction")
        self.wait(lambda: all(self.monitor.state(n) == "OK" for n in self.WELL),
                  "all are well")

    def stop_for(self, name, stop_s, channel):
        """SIGSTOP, and SIGCONT after a while; waits until the process works on new messages."""
        self.wait_until_all_work()
        before = self.swarm.pids()
        os.kill(before[name], signal.SIGSTOP)
        time.sleep(stop_s)
        mark = self.messages(name, channel)
        os.kill(before[name], signal.SIGCONT)
        self.wait(lambda: self.messages(name, channel) > mark + 5, f"{name} works again")
        self.wait_until_all_work()
        self.assertEqual(self.swarm.pids(), before)

    def metric(self, process, name):
        return self.monitor.process(process)["metrics"][name]

    def kill(self, name, *streams):
        """SIGKILL; waits for the successor's report and checks that nobody else was replaced and
        that the streams, as (receiver, channel, domain), bring their receivers something new."""
        self.wait_until_all_work()
        before = self.swarm.pids()
        marks = {stream: 0 if stream[0] == name else self.messages(*stream) for stream in streams}
        os.kill(before[name], signal.SIGKILL)
        self.wait(lambda: (self.monitor.process(name) or {"pid": before[name]})["pid"]
                  not in (before[name], 0), f"a new {name} reports")
        for stream, mark in marks.items():
            self.wait(lambda stream=stream, mark=mark: self.messages(*stream) > mark,
                      f"{stream[1]} reaches {stream[0]}")
        self.wait_until_all_work()
        after = self.swarm.pids()
        self.assertNotEqual(after.pop(name), before.pop(name))
        self.assertEqual(after, before, f"somebody else died when {name} was killed")
