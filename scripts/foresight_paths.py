"""Where things are in a checkout; shared by the scripts."""
import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent


def build_dir(sanitize=False):
    """The build folder: $FORESIGHT_BUILD_DIR, else build/ in the checkout; sanitized: …-sanitize."""
    folder = str(pathlib.Path(os.environ.get("FORESIGHT_BUILD_DIR") or ROOT / "build").absolute())
    return pathlib.Path(folder + ("-sanitize" if sanitize else ""))


def out_dir():
    """For what is recorded and deployed: $FORESIGHT_OUT_DIR, else out/ in the checkout."""
    return pathlib.Path(os.environ.get("FORESIGHT_OUT_DIR") or ROOT / "out").absolute()


def program(name):
    """The built program foresight-NAME."""
    return build_dir() / "bin" / f"foresight-{name}"
