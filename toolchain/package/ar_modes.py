#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ar_modes.py PACKAGE.deb...: gives the members of the archive that a package is the mode 0644. CPack takes that of its own temporary
files, which is the umask's of whoever packs."""
import sys

HEAD, MODE, SIZE = 60, slice(40, 48), slice(48, 58)  # of a member's header, ar(5)

for name in sys.argv[1:]:
    with open(name, "r+b") as file:
        assert file.read(8) == b"!<arch>\n", f"{name} is no ar archive"
        while head := file.read(HEAD):
            size = int(head[SIZE])
            file.seek(-HEAD + MODE.start, 1)
            file.write(b"100644  ")
            file.seek(HEAD - MODE.stop + size + size % 2, 1)
