# SPDX-License-Identifier: Apache-2.0
"""Puts the declarations of libwaymark.so into the wheel, and the library itself where WAYMARK_NATIVE names a folder with it."""

import importlib.util
import os
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Native(BuildHookInterface):
    def initialize(self, version, build_data):
        """The platform's tag is WAYMARK_PLATFORM, "manylinux_2_36_x86_64"."""
        source = Path(self.root) / "src/waymark/declarations.py"
        spec = importlib.util.spec_from_file_location("declarations", source)
        declarations = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(declarations)
        made = Path(tempfile.mkdtemp(prefix="waymark-wheel-")) / "waymark.cdef"
        made.write_text(declarations.text(), encoding="utf-8")
        build_data["force_include"][str(made)] = "waymark/native/waymark.cdef"
        folder = os.environ.get("WAYMARK_NATIVE")
        if folder:
            for path in sorted(Path(folder).iterdir()):
                build_data["force_include"][str(path)] = f"waymark/native/{path.name}"
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{os.environ['WAYMARK_PLATFORM']}"
