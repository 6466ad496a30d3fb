#!/usr/bin/python3
"""What the pages say exists: every path, every link, every test that a page names."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOP = "(?:bench|cmake|common|deploy|docs|lcmtypes|procs|scripts|sim|tests)"
# `procs/slam/slam.cc`, docs/sim.md; not procs/NAME/params.h, deploy/*.yaml, out/…
PATH = re.compile(rf"(?<![\w./-])({TOP}/[\w./-]*[\w/])(?![\w*{{]|/?\*)")
BARE_FILE = re.compile(r"`([\w-]+\.(?:cc|h|py|lcm|yaml|md))`")
LINK = re.compile(r"\]\((?!https?:)([^)#]+)\)")
TEST_SUITE = re.compile(r"`(\w+)\.[\w*…]*[*…A-Z][\w*…]*`")
PEOPLES_FILES = {"camera.yaml"}  # not ours
NAMES_OF_ANY = {"NAME", "SITE", "X"}  # parts of a path that stand for many


def pages():
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("procs/*/README.md"),
                   *ROOT.glob("sim/**/*.md")])


def is_there(path):
    """A file, a folder, or one of several files of this name: procs/omni/process.{h,cc}."""
    whole = ROOT / path.rstrip("/")
    return whole.exists() or any(whole.parent.glob(whole.name + ".*")) or any(
        whole.parent.glob(whole.name + "-*"))  # docs/decisions/0008


class Pages(unittest.TestCase):
    def setUp(self):
        self.files = {p.name for folder in TOP[3:-1].split("|")
                      for p in (ROOT / folder).rglob("*") if p.is_file()}
        self.files |= {p.name for p in ROOT.iterdir()}

    def test_every_path_exists(self):
        for page in pages():
            if page.name == "CHANGELOG.md":  # tells of what is gone, too
                continue
            for path in PATH.findall(page.read_text(encoding="utf-8")):
                if NAMES_OF_ANY & set(re.split("[/.]", path)):
                    continue
                with self.subTest(page=page.name, path=path):
                    self.assertTrue(is_there(path) or is_there(f"{page.parent}/{path}"))

    def test_every_file_named_without_its_folder_exists(self):
        for page in pages():
            for name in BARE_FILE.findall(page.read_text(encoding="utf-8")):
                with self.subTest(page=page.name, name=name):
                    self.assertTrue(name in self.files or name in PEOPLES_FILES)

    def test_every_link_leads_somewhere(self):
        for page in pages():
            for link in LINK.findall(page.read_text(encoding="utf-8")):
                with self.subTest(page=page.name, link=link):
                    self.assertTrue((page.parent / link).exists())

    def test_every_test_that_reliability_names_exists(self):
        sources = "\n".join(p.read_text(encoding="utf-8") for p in (ROOT / "tests").rglob("*")
                            if p.suffix in (".cc", ".py", ".h"))
        names = TEST_SUITE.findall((ROOT / "docs/reliability.md").read_text(encoding="utf-8"))
        self.assertGreater(len(names), 20)
        for name in names:
            with self.subTest(name=name):
                self.assertRegex(sources, rf"\b{name}\b")


if __name__ == "__main__":
    unittest.main()
