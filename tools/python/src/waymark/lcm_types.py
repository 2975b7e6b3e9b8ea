# SPDX-License-Identifier: Apache-2.0
"""The LCM message types of a run as Python classes: `from waymark import pose_t`, as lcm-gen names them."""

import atexit
import importlib
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).with_name("lcm")
"""In a wheel; made when it is built."""


def generate(folder: Path) -> Path:
    """Makes the classes of the repository's msgs/lcm in a folder, by lcm-gen; the folder with the modules."""
    types = sorted((Path(__file__).resolve().parents[4] / "msgs/lcm").glob("*.lcm"))
    program = shutil.which("lcm-gen") or shutil.which("lcm-gen", path=str(Path(sys.executable).parent))
    if not types or not program:
        raise ImportError("the message types need lcm-gen (pip install lcm, or Debian's liblcm-bin)" if types else
                          "this installation has no message types: install a wheel, or from the repository")
    subprocess.run([program, "-p", "--ppath", folder, *types], check=True)
    return folder / "waymark"


@cache
def load() -> dict[str, type]:
    """The classes by their names. They become attributes of the package, where those made by lcm-gen look for each other."""
    import waymark

    folder = FOLDER
    if not folder.is_dir():
        made = tempfile.mkdtemp(prefix="waymark-lcm-")
        atexit.register(shutil.rmtree, made, ignore_errors=True)
        folder = generate(Path(made))
    waymark.__path__.append(str(folder))
    names = [path.stem for path in sorted(folder.glob("*_t.py"))]
    classes = {name: getattr(importlib.import_module(f"waymark.{name}"), name) for name in names}
    for name, kind in classes.items():
        setattr(waymark, name, kind)
    return classes
