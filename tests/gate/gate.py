#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `./dev test` has to lint and to run under sanitizers, and what its tests skipped (docs/decisions/006-gate.md).

    gate.py base                    the commit that changes are counted from; nothing where everything counts
    gate.py lint BUILD BASE         sources to lint, one a line; without BASE all
    gate.py tests BUILD BASE LABEL  what to build for the sanitizer's tests, and which to run: two lines, or nothing;
                                    of the tests with LABEL, or with - of all but those labelled slow or release-only
    gate.py skips RUN ...           the tests that were skipped, from tests.xml of each RUN's folder; fails where one
                                    needs a thing that WAYMARK_REQUIRE names
    gate.py passed                  after a run that checked everything: this commit is the base from now on (tests/gate/base)

A source counts as changed where it, or a file that it includes, differs from BASE or is not committed. BUILD is a release
build that is up to date: its compiler wrote down what each object includes."""
import json
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
BASE_FILE = ROOT / "tests/gate/base"
# Changes of these can change any object or any finding.
RULES = re.compile(r"(cmake/.*|CMakeLists\.txt|CMakePresets\.json|\.clang-tidy|\.ci/.*|tests/gate/gate\.py)$")
# What a test may lack, by the words of its last line.
NEEDS = {
    "data": r"recording|data",
    "lcm": r"lcm",
    "netns": r"namespace|network|unshare|right to",
    "judges": r"judge|cantools|browser|chrom",
    "tools": r"strace|systemd|valgrind|is not there|missing",
}


def git(*arguments):
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def is_ancestor(commit):
    return subprocess.run(["git", "merge-base", "--is-ancestor", commit, "HEAD"], cwd=ROOT, capture_output=True,
                          check=False).returncode == 0


def base():
    """WAYMARK_BASE; or where this branch left the main one; or the commit that last passed with everything checked."""
    if "WAYMARK_BASE" in os.environ:
        return git("rev-parse", "--verify", "-q", os.environ["WAYMARK_BASE"] + "^{commit}") if os.environ["WAYMARK_BASE"] else ""
    fork = git("merge-base", "HEAD", "origin/main")
    if fork and fork != git("rev-parse", "HEAD"):
        return fork
    recorded = BASE_FILE.read_text().split()[0] if BASE_FILE.exists() else ""
    return recorded if recorded and is_ancestor(recorded) else ""


def changed_files(since):
    names = git("diff", "--name-only", "--no-renames", since).splitlines()
    return set(names) | set(git("ls-files", "--others", "--exclude-standard").splitlines())


class Build:
    def __init__(self, folder, since):
        self.folder = pathlib.Path(folder).resolve()
        self.everything = not since
        self.changed = changed_files(since) if since else set()
        if any(RULES.match(name) for name in self.changed):
            self.everything = True
        # A folder's list may have changed the options of all below it.
        self.folders = tuple(name[:-len("CMakeLists.txt")] for name in self.changed if name.endswith("/CMakeLists.txt"))
        self.commands = json.loads((self.folder / "compile_commands.json").read_text())

    def place(self, name):
        """A path as the build names it, from the repository's root."""
        return os.path.relpath(os.path.normpath(self.folder / name), ROOT)

    def is_changed(self, place):
        return self.everything or place in self.changed or place.startswith(self.folders)

    def ninja(self, *arguments):
        return subprocess.run(["ninja", "-C", self.folder, *arguments], capture_output=True, text=True,
                              check=True).stdout.splitlines()

    def objects(self):
        """Objects whose source or one of its headers changed."""
        out, current = set(), None
        for line in self.ninja("-t", "deps"):
            if line and not line[0].isspace():
                current = line.split(":")[0]
            elif line.strip() and current and self.is_changed(self.place(line.strip())):
                out.add(current)
        return out

    def lint(self):
        objects = set() if self.everything else self.objects()
        out = set()
        for entry in self.commands:
            place = self.place(entry["file"])
            made = os.path.relpath(os.path.normpath(pathlib.Path(entry["directory"]) / output_of(entry)), self.folder)
            if place.startswith(("build", ".cache", "tests/", "..")):
                continue
            if self.everything or made in objects or self.is_changed(place):
                out.add(place)
        return sorted(out)

    def tests(self, label):
        listed = subprocess.run(["ctest", "--test-dir", self.folder, "--show-only=json-v1"], capture_output=True,
                                text=True, check=True).stdout
        objects = set() if self.everything else self.objects()
        outputs = {line.split(":")[0] for line in self.ninja("-t", "targets", "all")}
        programs = sorted(name for name in outputs if re.fullmatch(r"bin/waymark(-[a-z]+)?", name))
        known = {}

        def is_touched(output):
            if output not in known:
                known[output] = self.everything or any(
                    name in objects or self.is_changed(self.place(name)) for name in self.ninja("-t", "inputs", output))
            return known[output]

        needed, names = set(), []
        for test in json.loads(listed)["tests"]:
            labels = next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
            if (label not in labels) if label != "-" else ({"slow", "release-only"} & set(labels)):
                continue
            command = test.get("command", [])
            uses = {os.path.relpath(word, self.folder) for word in command if word.startswith(str(self.folder) + "/")}
            uses &= outputs
            is_script = not (command and os.path.relpath(command[0], self.folder) in outputs)
            if is_script:
                uses |= set(programs)
            scripts = [os.path.relpath(word, ROOT) for word in command if word.startswith(str(ROOT) + "/tests/")]
            own = any(self.is_changed(name) or name.startswith("config/") for name in self.changed
                      if is_script and any(os.path.dirname(name) == os.path.dirname(s) for s in scripts)
                      or is_script and name.startswith("config/"))
            if self.everything or own or any(is_touched(name) for name in sorted(uses)):
                needed |= uses
                names.append(test["name"])
        return sorted(needed), names


def output_of(entry):
    return entry.get("output") or re.search(r" -o (\S+)", entry["command"]).group(1)


def skipped_tests(folder):
    """(test, reason): those that returned 77, and parts of tests that were ignored."""
    out = []
    for case in xml.etree.ElementTree.parse(folder / "tests.xml").getroot().iter("testcase"):
        lines = [line.strip() for line in (case.findtext("system-out") or "").splitlines() if line.strip()]
        if case.find("skipped") is not None and case.get("status") != "disabled":
            reason = re.sub(r"^skipped[^:]*: ", "", lines[-1]) if lines else "no reason given"
            out.append((case.get("name"), reason))
        out += [(case.get("name"), line.split(":", 2)[2]) for line in lines if re.search(r":IGNORE\b", line)]
    return out


def skips(folders):
    required = [name for name in os.environ.get("WAYMARK_REQUIRE", "").split(",") if name]
    unknown = [name for name in required if name not in NEEDS and name != "all"]
    if unknown:
        sys.exit(f"WAYMARK_REQUIRE: {', '.join(unknown)} is not one of all, {', '.join(NEEDS)}")
    is_good = True
    for folder in folders:
        for name, reason in skipped_tests(pathlib.Path(folder)):
            missing = [need for need in required if need == "all" or re.search(NEEDS[need], reason, re.IGNORECASE)]
            print(f"  skipped: {name}: {reason}", file=sys.stderr if missing else sys.stdout)
            is_good = is_good and not missing
    if not is_good:
        sys.exit(f"WAYMARK_REQUIRE={','.join(required)}: a test was skipped for want of it")


def main():
    command, arguments = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("", [])
    if command == "base" and not arguments:
        print(base())
    elif command == "lint" and len(arguments) == 2:
        for source in Build(*arguments).lint():
            print(source)
    elif command == "tests" and len(arguments) == 3:
        outputs, names = Build(*arguments[:2]).tests(arguments[2])
        if names:
            print(" ".join(outputs), "^(" + "|".join(re.escape(name) for name in names) + ")$", sep="\n")
    elif command == "skips" and arguments:
        skips(arguments)
    elif command == "passed" and not arguments:
        BASE_FILE.write_text(git("rev-parse", "HEAD") + "\n")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
