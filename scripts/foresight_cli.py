"""What every script in Python shares: exit codes, its command line, errors as one line."""
import argparse
import contextlib
import math
import os
import pathlib
import signal
import subprocess
import sys
import traceback

# As of the programs (common/errors.h). 128 + the signal when it was interrupted.
EXIT_USAGE, EXIT_UNAVAILABLE, EXIT_BUG, EXIT_CONFIG = 64, 69, 70, 78
LONGEST_LINE = 400  # characters of somebody else's text
LONGEST_FAILURE = 4000


class Failure(Exception):
    """One line for people, and an exit code."""

    def __init__(self, line, code=EXIT_UNAVAILABLE):
        super().__init__(one_line(line, LONGEST_FAILURE))
        self.code = code


class Parser(argparse.ArgumentParser):
    """Wrong usage is one line and 64, as with every program."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter,
                         allow_abbrev=False, **options)

    def error(self, message):
        self.exit(EXIT_USAGE, f"scripts/{self.prog}: {one_line(message)} (see --help)\n")


def one_line(text, longest=LONGEST_LINE):
    """Text from files, the network and programs, fit for a line of a terminal: no control
    characters, no halves of characters, not endless."""
    text = str(text).encode("utf-8", "replace").decode("utf-8")
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= longest else text[:longest] + " …"


def number(least, most=math.inf):
    """For argparse: a finite number within limits."""
    def read(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or not least <= value <= most:
            limit = f"at least {least}" if most == math.inf else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"must be a number, {limit}, is '{text}'")
        return value
    return read


def whole_number(least):
    """For argparse."""
    def read(text):
        value = number(least)(text)
        if value != int(value):
            raise argparse.ArgumentTypeError(f"must be a whole number, is '{text}'")
        return int(value)
    return read


def captured(command, **options):
    """A finished program with what it wrote as text, whatever bytes they were."""
    return subprocess.run([os.fspath(word) if isinstance(word, pathlib.Path) else str(word)
                           for word in command], capture_output=True, encoding="utf-8",
                          errors="replace", check=False, **options)


def end_on(*numbers):
    """These signals end the script as Ctrl-C does: `finally` and `with` are done first."""
    def end(number_, _):
        raise SystemExit(128 + number_)
    for number_ in numbers:
        if signal.getsignal(number_) != signal.SIG_IGN:  # nohup
            signal.signal(number_, end)


@contextlib.contextmanager
def uninterrupted():
    """What cleans up is not to be stopped by an impatient second Ctrl-C."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    # A handler and not SIG_IGN, which the programs that we start would inherit.
    before = {number_: signal.signal(number_, lambda *_: None) for number_ in numbers}
    try:
        yield
    finally:
        for number_, handler in before.items():
            signal.signal(number_, handler)


def run(main):
    """Runs a script's main() and ends with its exit code; what went wrong is one line."""
    name = f"scripts/{pathlib.Path(sys.argv[0]).name}"
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # a terminal that lacks a character is no reason to end
    try:
        code = main()
        sys.stdout.flush()
    except Failure as failure:
        print(f"{name}: {failure}", file=sys.stderr)
        code = failure.code
    except subprocess.CalledProcessError as error:
        code = error.returncode if error.returncode > 0 else EXIT_UNAVAILABLE  # it has said why
    except BrokenPipeError:  # of a pager that was left
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 128 + signal.SIGPIPE
    except OSError as error:
        where = f"{os.fsdecode(error.filename)}: " if error.filename is not None else ""
        print(f"{name}: {one_line(where + (error.strerror or str(error)))}", file=sys.stderr)
        code = EXIT_UNAVAILABLE
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    except Exception:  # a bug: where it is matters to whoever mends it
        traceback.print_exc()
        code = EXIT_BUG
    sys.exit(code)
