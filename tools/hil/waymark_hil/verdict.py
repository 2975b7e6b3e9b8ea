# SPDX-License-Identifier: Apache-2.0
"""Checks of a run, and what they are written as: result.json and JUnit XML (the schema that Jenkins and GitLab read)."""
import dataclasses
import json
import math
import xml.etree.ElementTree as xml

FORMAT = "waymark-hil/1"
PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"
# Characters that XML 1.0 does not allow.
_NOT_XML = {code: "?" for code in range(32) if code not in (9, 10, 13)}


@dataclasses.dataclass
class Check:
    """One thing that was judged."""

    group: str  # a test suite
    name: str
    status: str
    text: str  # what was found, with units
    value: float | None = None
    limit: float | None = None
    seconds: float = 0.0

    def row(self):
        """For JSON."""
        return _finite(dataclasses.asdict(self))


class Checks(list):
    """The checks of a run, in their order."""

    def add(self, group, name, is_good, text, value=None, limit=None):
        """A check; is_good None: it could not be judged."""
        status = SKIPPED if is_good is None else PASSED if is_good else FAILED
        self.append(Check(group, name, status, text, value, limit))
        return bool(is_good)

    def at_most(self, group, name, value, limit, text):
        """A check of a number against its limit; None: it could not be judged."""
        return self.add(group, name, None if value is None else value <= limit, text, value, limit)

    def failed(self):
        """Those that failed."""
        return [check for check in self if check.status == FAILED]

    def groups(self):
        """{group: checks}, in their order."""
        out = {}
        for check in self:
            out.setdefault(check.group, []).append(check)
        return out


def junit(checks, name, seconds, said=""):
    """JUnit XML of the checks; a suite for each group."""
    def count(rows, status):
        return str(sum(check.status == status for check in rows))
    top = xml.Element("testsuites", name=name, tests=str(len(checks)), failures=count(checks, FAILED), errors="0", time=f"{seconds:.3f}")
    for number, (group, rows) in enumerate(checks.groups().items()):
        suite = xml.SubElement(top, "testsuite", name=group, tests=str(len(rows)), failures=count(rows, FAILED), errors="0",
                               skipped=count(rows, SKIPPED), time=f"{seconds if number == 0 else 0:.3f}")
        for check in rows:
            case = xml.SubElement(suite, "testcase", classname=f"{name}.{group}", name=check.name, time=f"{check.seconds:.3f}")
            text = check.text.translate(_NOT_XML)
            if check.status == FAILED:
                xml.SubElement(case, "failure", message=text, type="limit").text = text
            elif check.status == SKIPPED:
                xml.SubElement(case, "skipped", message=text)
            else:
                xml.SubElement(case, "system-out").text = text
        if number == 0 and said:
            xml.SubElement(suite, "system-err").text = said.translate(_NOT_XML)
    xml.indent(top)
    return xml.tostring(top, encoding="utf-8", xml_declaration=True)


def _finite(value):
    """For JSON: numbers that are not finite are null."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write(folder, result, checks, said=""):
    """result.json and junit.xml."""
    whole = {"format": FORMAT, **_finite(result), "verdict": FAILED if checks.failed() else PASSED, "checks": [check.row() for check in checks]}
    (folder / "result.json").write_text(json.dumps(whole, indent=1, allow_nan=False, default=str), encoding="utf-8")
    (folder / "junit.xml").write_bytes(junit(checks, result["name"], result.get("took_s", 0.0), said))
    return whole
