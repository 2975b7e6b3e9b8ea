# SPDX-License-Identifier: Apache-2.0
"""Puts the declarations of libwaymark.so and the LCM message types into the wheel, and the library itself where WAYMARK_NATIVE
names a folder with it."""

import importlib.util
import os
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Native(BuildHookInterface):
    def _module(self, name):
        spec = importlib.util.spec_from_file_location(name, Path(self.root) / f"src/waymark/{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    def initialize(self, version, build_data):
        """The platform's tag is WAYMARK_PLATFORM, "manylinux_2_36_x86_64"."""
        self._made = tempfile.TemporaryDirectory(prefix="waymark-wheel-")
        made = Path(self._made.name)
        (made / "waymark.cdef").write_text(self._module("declarations").text(), encoding="utf-8")
        build_data["force_include"][str(made / "waymark.cdef")] = "waymark/native/waymark.cdef"
        for path in self._module("lcm_types").generate(made).glob("*_t.py"):
            build_data["force_include"][str(path)] = f"waymark/lcm/{path.name}"
        folder = os.environ.get("WAYMARK_NATIVE")
        if folder:
            for path in sorted(Path(folder).iterdir()):
                build_data["force_include"][str(path)] = f"waymark/native/{path.name}"
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{os.environ['WAYMARK_PLATFORM']}"

    def finalize(self, version, build_data, artifact_path):
        """Removes what was made for the wheel."""
        self._made.cleanup()
