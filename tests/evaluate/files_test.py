#!/usr/bin/python3
"""What people's files look like: small inputs of each kind, the same answer from every tool."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build") / "bin"
DATA = pathlib.Path(os.environ.get("FORESIGHT_DATA") or ROOT / ".." / "shared" / "data")
WILD = DATA / "wild"
DONE, USAGE, UNAVAILABLE, CONFIG = 0, 64, 69, 78
CAMERA = """model: pinhole_radtan
width: 160
height: 120
fx: 131
fy: 131
cx: 79
cy: 59
k1: 0
k2: 0
p1: 0
p2: 0
"""


def run(name, *arguments, **options):
    return subprocess.run([BIN / name, *map(str, arguments)], capture_output=True, text=True,
                          check=False, timeout=500, **options)


def said(done):
    """Both streams as one line of words."""
    return " ".join((done.stdout + done.stderr).split())


class Tools(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def write_images(self, name, count=4, size=(160, 120)):
        """A folder without a camera file; the images differ a little."""
        folder = self.folder / name
        folder.mkdir()
        for i in range(count):
            picture = Image.radial_gradient("L").resize(size).convert("RGB")
            picture.paste((200, 30 * i, 60), (20 + 3 * i, 20, 70, 70))
            picture.save(folder / f"{i}.jpg", quality=90)
        self.list_images(folder, [f"{0.1 * i:.1f} {i}.jpg" for i in range(count)])
        return folder

    def list_images(self, folder, lines, end="\n"):
        (folder / "rgb.txt").write_text(end.join(lines) + end, encoding="utf-8", newline="")

    def evaluate(self, source, *more):
        return run("evaluate", source, *more)

    def slam(self, source, *more):
        return run("slam-eval", source, *more)

    def both(self, source, code, *parts):
        """evaluate and slam-eval end alike and say the same."""
        for tool in (self.evaluate, self.slam):
            done = tool(source)
            for part in parts:
                self.assertIn(part, said(done), tool)
            self.assertEqual(done.returncode, code, (tool, said(done)))

    def calibrate(self, source, *more):
        return run("calibrate-camera", source, "--every", 1, "--output",
                   self.folder / "made.yaml", *more)


class Files(Tools):
    # One reader: lists.

    def test_lists_that_every_tool_reads(self):
        folder = self.write_images("images")
        (folder / "0.jpg").rename(folder / "my 0.jpg")
        absolute = self.folder / "elsewhere.jpg"
        (folder / "3.jpg").rename(absolute)
        lines = ["\ufeff0.0,my 0.jpg", "  ", "0.1\t1.jpg", "0.2 2.jpg  ", f"0.3 {absolute}", "   "]
        self.list_images(folder, lines, end="\r\n")
        self.both(folder, DONE, "intrinsics are guessed (focal length 144 px)")
        self.assertIn("4 frames", said(self.evaluate(folder)))

    def test_nanosecond_stamps_are_read(self):
        folder = self.write_images("images")
        self.list_images(folder, [f"{1403636579763555584 + i * 10**8} {i}.jpg" for i in range(4)])
        self.both(folder, DONE)

    def test_lists_that_every_tool_refuses_by_name(self):
        folder = self.write_images("images")
        for lines, cause in (
                (["0.0 0.jpg", "0.0 1.jpg"], "rgb.txt:2: its time is that of the image above it"),
                (["0.1 0.jpg", "0.0 1.jpg"], "rgb.txt:2: its time is before"),
                (["0.0 0.jpg", "nan 1.jpg"], "rgb.txt:2: 'nan' is no time"),
                (["0.0"], "rgb.txt:1: names no file"),
                (["# nothing"], "lists no frames")):
            self.list_images(folder, lines)
            self.both(folder, CONFIG, cause)
            self.assertIn(cause, said(run("mesh-eval", folder)))
            done = self.calibrate(folder)
            self.assertEqual(done.returncode, CONFIG)
            self.assertIn(cause, said(done))

    # Images.

    def test_images_that_cannot_be_used_are_left_out_counted_and_named(self):
        folder = self.write_images("images", count=8)
        (folder / "2.jpg").unlink()
        (folder / "4.jpg").write_bytes(b"")
        (folder / "6.jpg").write_text("no picture", encoding="utf-8")
        self.both(folder, UNAVAILABLE, "3 of 8 images could not be used",
                  "2.jpg: does not exist", "4.jpg: is empty", "6.jpg: cannot be read as an image")
        for tool in (self.evaluate, self.slam):
            numbers = self.folder / "numbers.json"
            self.assertEqual(tool(folder, "--json", numbers).returncode, UNAVAILABLE)
            (figures,) = json.loads(numbers.read_text(encoding="utf-8"))
            self.assertEqual(figures["frames"], 5)
            self.assertEqual(figures["refused_images"], 3)
            self.assertEqual(figures["intrinsics_guessed"], 1)
            self.assertAlmostEqual(figures["focal_px"], 144)

    def test_images_that_change_size_are_refused_and_nothing_is_compared_with_itself(self):
        folder = self.write_images("images", count=60)
        for i in range(3, 60):
            Image.new("RGB", (80, 60), (9, 9, i)).save(folder / f"{i}.jpg")
        self.both(folder, UNAVAILABLE, "57 of 60 images could not be used",
                  "3.jpg: is 80x60 px, not 160x120")
        self.assertNotIn("60.00", said(self.evaluate(folder)))

    def test_without_a_usable_image_nothing_succeeds(self):
        folder = self.write_images("images")
        for i in range(4):
            (folder / f"{i}.jpg").write_bytes(b"\xff\xd8\xff")
        self.both(folder, UNAVAILABLE, "0.jpg: damaged JPEG")
        self.assertEqual(self.calibrate(folder).returncode, UNAVAILABLE)

    def test_odd_jpegs_are_used_and_warned_about(self):
        folder = self.write_images("images")
        for i in range(4):
            whole = (folder / f"{i}.jpg").read_bytes()
            (folder / f"{i}.jpg").write_bytes(whole[:-2] if i % 2 else
                                              whole[:20] + b"\x01\x02" + whole[20:])
        self.both(folder, DONE, "2 of 4 images: Premature end of JPEG file",
                  "2 of 4 images: Corrupt JPEG data: 2 extraneous bytes")

    def test_cmyk_is_converted_by_name(self):
        folder = self.write_images("images")
        for i in range(4):
            Image.open(folder / f"{i}.jpg").convert("CMYK").save(folder / f"{i}.jpg")
        self.both(folder, DONE, "4 of 4 images: CMYK picture")

    def test_exif_turns_the_picture_in_every_tool(self):
        folder = self.write_images("images")
        exif = Image.Exif()
        exif[0x0112] = 6
        for i in range(4):
            Image.open(folder / f"{i}.jpg").save(folder / f"{i}.jpg", exif=exif)
        self.both(folder, DONE)
        (folder / "camera.yaml").write_text(CAMERA, encoding="utf-8")
        self.both(folder, CONFIG, "is for 160x120 px, the images have 120x160", "swapped")

    def test_sixteen_bit_images_say_how_many_bits_they_use(self):
        folder = self.write_images("images")
        for i in range(4):
            picture = Image.open(folder / f"{i}.jpg").convert("I")
            picture.point(lambda v: v * 16).convert("I;16").save(folder / f"{i}.png")
        self.list_images(folder, [f"{i} {i}.png" for i in range(4)])
        self.both(folder, DONE, "use 12 of 16 bits")

    # Camera files, in every tool.

    def test_camera_files(self):
        folder = self.write_images("images")
        ros = """image_width: 160
image_height: 120
camera_matrix: {rows: 3, cols: 3, data: [131, 0, 79, 0, 131, 59, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""
        twice = CAMERA.replace("160", "320").replace("120", "240").replace("131", "262")
        for text, code, part in (
                (CAMERA, DONE, ""), (ros, DONE, ""),
                (twice, DONE, "camera.yaml is for 320x240 px, the images have 160x120: scaled"),
                (CAMERA.replace("120", "90"), CONFIG, "another aspect"),
                (CAMERA.replace("fx: 131", "fx: 0.82"), CONFIG, "fx: 0.82 is outside"),
                (CAMERA.replace("cx: 79", "cx: -79"), CONFIG, "cx: -79 is outside [0, 160]"),
                (CAMERA + "k4: 0.3\n", CONFIG, "k4: 0.3 belongs to another lens model"),
                ("focal: 131\n", CONFIG, "write model, width")):
            (folder / "camera.yaml").write_text(text, encoding="utf-8")
            self.both(folder, code, part)

    # Truth.

    def test_truth_of_another_time_is_said(self):
        folder = self.write_images("images")
        (folder / "groundtruth.txt").write_text("500 0 0 0 0 0 0 1\n501 0 0 0 0 0 0 1\n",
                                                encoding="utf-8")
        done = self.slam(folder)
        self.assertIn("its times (500.000 to 501.000 s) match no image (0.000 to 0.300 s)",
                      said(done))
        self.assertEqual(done.returncode, DONE)

    # Videos.

    def make_video(self, name="room.mp4", *options):
        folder = self.folder / "video"
        folder.mkdir(exist_ok=True)
        video = folder / name
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "lavfi", "-i",
                        "testsrc2=s=160x120:r=20:d=2", "-pix_fmt", "yuv420p", "-g", "10",
                        *options, video], check=True, stdin=subprocess.DEVNULL)
        return video

    def test_the_camera_file_beside_a_video_is_used(self):
        video = self.make_video()
        self.both(video, DONE, "intrinsics are guessed (focal length 144 px)")
        (video.parent / "camera.yaml").write_text(CAMERA, encoding="utf-8")
        self.both(video, DONE, "camera.yaml, beside the video")
        numbers = self.folder / "numbers.json"
        for tool in (self.evaluate, self.slam):
            tool(video, "--json", numbers)
            (figures,) = json.loads(numbers.read_text(encoding="utf-8"))
            self.assertEqual(figures["frames"], 40)
            self.assertEqual(figures["intrinsics_guessed"], 0)
            self.assertAlmostEqual(figures["focal_px"], 131)

    def test_a_damaged_video_is_decoded_as_far_as_it_goes(self):
        video = self.make_video()
        content = bytearray(video.read_bytes())
        content[len(content) // 3:len(content) // 2] = bytes(len(content) // 2 - len(content) // 3)
        video.write_bytes(content)
        self.both(video, UNAVAILABLE, "of 40 frames", "ended after")

    # Outputs.

    def test_outputs_are_checked_before_a_run(self):
        folder = self.write_images("images")
        nowhere = self.folder / "none" / "out"
        for tool, option, path, code in (
                ("evaluate", "--grid", self.folder / "grid", USAGE),
                ("evaluate", "--json", nowhere, UNAVAILABLE),
                ("evaluate", "--csv", self.folder, UNAVAILABLE),
                ("slam-eval", "--json", nowhere, UNAVAILABLE),
                ("slam-eval", "--table", nowhere, UNAVAILABLE),
                ("slam-eval", "--plots", folder / "0.jpg", UNAVAILABLE),
                ("mesh-eval", "--json", nowhere, UNAVAILABLE),
                ("mesh-eval", "--picture", folder / "0.jpg", UNAVAILABLE),
                ("calibrate-camera", "--picture", self.folder / "corners", USAGE),
                ("calibrate-camera", "--output", nowhere, UNAVAILABLE)):
            done = run(tool, folder, option, path)
            self.assertEqual(done.returncode, code, (tool, option, said(done)))
            self.assertEqual(done.stdout, "", (tool, option))
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(f"{option} {path}: ", done.stderr)

    def test_a_full_disk_is_said_after_the_scores(self):
        folder = self.write_images("images")
        for tool, option in (("evaluate", "--json"), ("evaluate", "--csv"),
                             ("slam-eval", "--json"), ("slam-eval", "--table")):
            done = run(tool, folder, option, "/dev/full")
            self.assertEqual(done.returncode, UNAVAILABLE, (tool, option))
            self.assertIn("/dev/full: cannot be written: No space left", done.stderr)
            self.assertIn("images", done.stdout)

    def test_a_full_disk_behind_standard_output_is_said(self):
        folder = self.write_images("images")
        with open("/dev/full", "w", encoding="utf-8") as full:
            done = subprocess.run([BIN / "evaluate", folder], stdout=full, stderr=subprocess.PIPE,
                                  text=True, check=False, timeout=500)
        self.assertEqual(done.returncode, UNAVAILABLE)
        self.assertIn("standard output cannot be written", done.stderr)

    def test_one_bad_sequence_does_not_lose_the_others(self):
        folder = self.write_images("images")
        for tool in (self.evaluate, self.slam):
            numbers = self.folder / "numbers.json"
            done = tool(folder, self.folder / "none", "--json", numbers)
            self.assertEqual(done.returncode, CONFIG, said(done))
            self.assertEqual(len(json.loads(numbers.read_text(encoding="utf-8"))), 1)


@unittest.skipUnless(WILD.is_dir(), f"{WILD} is missing: set FORESIGHT_DATA")
class Wild(Tools):
    """The collected inputs: what each must end with, and must say."""
    ANSWERS = {
        "video-vfr/vfr_slowstart.webm": (DONE, "focal length 288 px"),
        "video-truncated/dmg_mid.mp4": (UNAVAILABLE, "ended after 102 of 110 frames"),
        "video-upside-down/r90.mp4": (DONE, ""),
        "jpeg-tolerable/marker2": (DONE, "4 of 4 images: Corrupt JPEG data: 2 extraneous bytes"),
        "jpeg-tolerable/noeoi": (DONE, "4 of 4 images: Premature end of JPEG file"),
        "jpeg-cmyk": (DONE, "4 of 4 images: CMYK"),
        "png-12in16": (DONE, "use 12 of 16 bits"),
        "evaluate-never-ends": (UNAVAILABLE, "missing.jpg: does not exist"),
        "rgb-lists/blank-line-of-spaces": (DONE, ""),
        "rgb-lists/decreasing": (CONFIG, "rgb.txt:3: its time is before"),
        "rgb-lists/equal": (CONFIG, "rgb.txt:3: its time is that of"),
        "rgb-lists/file-name-with-space": (DONE, ""),
        "rgb-lists/nan-in-middle": (CONFIG, "rgb.txt:2: 'nan' is no time"),
        "rgb-lists/nanoseconds": (DONE, ""),
    }
    CAMERAS = {
        "cxneg": (CONFIG, "cx: -900 is outside [0, 320]"),
        "cxout": (CONFIG, "cx: 900 is outside [0, 320]"),
        "fxhuge": (CONFIG, "fx: 99000 is outside"),
        "fxnorm2": (CONFIG, "fx: 1.2 is outside"),
        "k8": (CONFIG, "k4: 0.3 belongs to another lens model"),
        "nok3": (DONE, ""),
        "opencv": (DONE, ""),
        "ros": (DONE, ""),
        "swapped": (CONFIG, "swapped"),
        "twice": (DONE, "scaled"),
    }

    def test_each_has_one_answer(self):
        for name, (code, part) in self.ANSWERS.items():
            with self.subTest(name):
                self.both(WILD / name, code, part)

    def test_each_camera_file_has_one_answer(self):
        folder = self.write_images("images", size=(320, 240))
        for name, (code, part) in self.CAMERAS.items():
            text = (WILD / "camera-files" / f"{name}.yaml").read_text(encoding="utf-8")
            (folder / "camera.yaml").write_text(text, encoding="utf-8")
            with self.subTest(name):
                self.both(folder, code, part)

    def test_the_exif_board_is_calibrated(self):
        done = self.calibrate(WILD / "exif-orientation" / "board_exif6", "--columns", 9,
                              "--rows", 6)
        self.assertEqual(done.returncode, DONE, said(done))
        made = (self.folder / "made.yaml").read_text(encoding="utf-8")
        self.both(WILD / "exif-orientation" / "board_exif6", DONE)
        self.assertGreater(int(made.split("height: ")[1].split()[0]),
                           int(made.split("width: ")[1].split()[0]), "upright")


if __name__ == "__main__":
    unittest.main()
