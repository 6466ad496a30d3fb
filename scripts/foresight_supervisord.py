"""Debian's supervisord, which looks after its processes ten times a second instead of once: a process
that was killed is back at once. Its own period is a constant inside it; started by
foresight_supervisor.py with supervisord's command line."""
from supervisor import poller, supervisord

LONGEST_WAIT_S = 0.1


def looking_often(poll):
    return lambda self, timeout_s: poll(self, min(timeout_s, LONGEST_WAIT_S))


if __name__ == "__main__":
    poller.Poller.poll = looking_often(poller.Poller.poll)
    supervisord.main()
