#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""No archive of drivers/ has mutable state at file scope: whatever a driver or a detector keeps belongs to an object that is
opened and closed, so that a configuration that is taken while a robot drives leaves nothing behind.

    stateless.py NM ARCHIVE ..."""
import re
import subprocess
import sys

# .data.rel.ro is constant after linking; what a sanitizer or the compiler adds is not the source's.
MUTABLE = re.compile(r"^(\*COM\*|\.?(data|bss|tdata|tbss)(?!\.rel\.ro)(\..*)?)$")
TOOLS = re.compile(r"^(__(asan|ubsan|tsan|odr_asan|sanitizer|sancov|gcov|start|stop)|\.L|_?_?llvm|DW\.ref\.|__tsan|_ZGV.*k[A-Z])")


def main():
    offences, objects = [], set()
    for archive in sys.argv[2:]:
        out = subprocess.run([sys.argv[1], "-A", "--format=sysv", archive], check=True, capture_output=True, text=True).stdout
        for line in out.splitlines():
            fields = [field.strip() for field in line.split("|")]
            if len(fields) < 7:
                continue
            where, _, name = fields[0].rpartition(":")
            member = where.rpartition(":")[2]
            objects.add(where)
            if not MUTABLE.match(fields[6]) or TOOLS.match(name) or fields[3] in ("SECTION", "FILE"):
                continue
            offences.append(f"{member}: {name} in {fields[6]}")
    for offence in offences:
        print(f"{offence}: mutable state at file scope")
    print(f"{len(objects)} objects, {len(offences)} offences")
    return 1 if offences or len(objects) < 40 else 0


if __name__ == "__main__":
    sys.exit(main())
