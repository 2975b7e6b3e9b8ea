#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `./dev test` has to lint and to run under sanitizers, and what its tests skipped (docs/decisions/006-gate.md).

    gate.py base                    the commit that changes are counted from; nothing where everything counts
    gate.py lint BUILD BASE [MOST]  sources to lint, one a line, by BUILD/lint/compile_commands.json; without BASE all. With MOST
                                    those that changed, and as many at most of those that include what changed; where a
                                    batch has several of them, the batch. A last line that begins with # counts what was left
    gate.py tests BUILD BASE RUN LABEL [MOST_S]
                                    what to build in RUN, a sanitizer's build, which tests to run there, and which of those
                                    that changed were left out: three lines, or nothing; of the tests with LABEL, or with - of
                                    all but those labelled slow or release-only. With MOST_S objects of so many seconds at
                                    most: tests that need the least beyond the others first
    gate.py skips RUN ...           the tests that were skipped, from tests.xml of each RUN's folder; fails where one
                                    needs a thing that WAYMARK_REQUIRE names
    gate.py passed                  after a run that checked everything: this commit is the base from now on (tests/gate/base)

A source counts as changed where it, or a file that it includes, differs from BASE or is not committed, or where the command
that compiles it does. BUILD is a release build that is up to date: its compiler wrote down what each object includes. RUN is
configured."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
BASE_FILE = ROOT / "tests/gate/base"
# A change of these may change commands: those of the base are made for comparison.
RULES = re.compile(r"(cmake/.*|.*\bCMakeLists\.txt|.*\.cmake|CMakePresets\.json)$")
# Seconds of a processor that an object takes under the address sanitizer, about: of C, of C++, of a batch of C++ sources.
OBJECT_S = {".c.o": 0.2, ".cpp.o": 2.0, ".cxx.o": 20.0}
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


def defined(folder, source):
    """What a configured build runs, with `source` in place of its paths: commands by their output, and tests by their name."""
    def plain(value):
        return json.dumps(value, sort_keys=True).replace(str(folder), "BUILD").replace(str(source), "SOURCE")
    made = subprocess.run(["ninja", "-C", folder, "-t", "compdb"], capture_output=True, text=True, check=True).stdout
    commands = {entry["output"]: plain(entry["command"]) for entry in json.loads(made) if not entry["output"].startswith("/")}
    tests = {}
    for listed in folder.rglob("CTestTestfile.cmake"):  # ctest's own list has no command of a program that isn't built
        for kind, name, rest in re.findall(r"^(add_test|set_tests_properties)\((?:\[=\[)?([\w.-]+)(?:\]=\])?(.*)\)$", listed.read_text(), re.M):
            environment = re.findall(r' ENVIRONMENT "([^"]*)"', rest)
            tests[name] = tests.get(name, "") + plain([rest] if kind == "add_test" else environment)
    return commands, tests


def defined_by(since, preset):
    """The same of the commit `since`, configured by itself; nothing where that fails."""
    with tempfile.TemporaryDirectory() as place:
        source = pathlib.Path(place).resolve() / "source"
        source.mkdir()
        with subprocess.Popen(["git", "archive", since], cwd=ROOT, stdout=subprocess.PIPE) as archive:
            subprocess.run(["tar", "-x", "-C", source], stdin=archive.stdout, check=True)
        (source / ".cache").mkdir()
        (source / ".cache/unity").symlink_to(ROOT / ".cache/unity")
        done = subprocess.run(["cmake", "--preset", preset, "-B", source / "build"], cwd=source, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"gate.py: {since[:7]} can't be configured here, so everything counts as changed", file=sys.stderr)
            return None
        return defined(source / "build", source)


class Build:
    def __init__(self, folder, since, run=None):
        self.folder = pathlib.Path(folder).resolve()
        self.everything = not since
        self.changed = changed_files(since) if since else set()
        # Outputs whose command is another than at the base, and tests that are.
        self.commands_changed, self.tests_changed = set(), set()
        if any(RULES.match(name) for name in self.changed):
            run = pathlib.Path(run or folder).resolve()
            before = defined_by(since, "release" if run == self.folder else run.name.removeprefix("build-"))
            self.everything = before is None
            if before:
                now = defined(run, ROOT)
                self.commands_changed, self.tests_changed = ({name for name in new if old.get(name) != new[name]}
                                                             for old, new in zip(before, now))
        self.commands = json.loads((self.folder / "compile_commands.json").read_text())

    def place(self, name):
        """A path as the build names it, from the repository's root."""
        return os.path.relpath(os.path.normpath(self.folder / name), ROOT)

    def is_changed(self, place):
        return self.everything or place in self.changed

    def ninja(self, *arguments):
        return subprocess.run(["ninja", "-C", self.folder, *arguments], capture_output=True, text=True,
                              check=True).stdout.splitlines()

    def objects(self, counts=lambda name: True):
        """Objects whose command, or whose source or one of its headers changed, of those names that count."""
        out, current = {name for name in self.commands_changed if name.endswith(".o")}, None
        for line in self.ninja("-t", "deps"):
            if line and not line[0].isspace():
                current = line.split(":")[0]
            elif line.strip() and current and counts(line.strip()) and self.is_changed(self.place(line.strip())):
                out.add(current)
        return out

    def sources(self):
        """Compile commands, one a source: a batch (CMake's unity build) has those of its sources."""
        for entry in self.commands:
            file = pathlib.Path(entry["file"])
            parts = re.findall(r'^#include "([^"]+)"', file.read_text(), re.M) if re.match(r"unity_\d+_", file.name) else []
            for part in parts or [entry["file"]]:
                yield {**entry, "file": part, "batch": entry["file"] if parts else "", "command": entry["command"].replace(f"-c {entry['file']}", f"-c {part}")}

    def lint(self, most=None):
        """(sources and batches to lint, how many sources those are, how many were left): sources whose own text changed, then those
        with a header or a command that did. All sources of a batch count where a header of it changed."""
        all_of_them = self.everything or ".clang-tidy" in self.changed
        objects = set() if all_of_them else self.objects(lambda name: not name.endswith((".c", ".cpp")))
        own, including, commands, batch_of = [], [], [], {}
        for entry in sorted(self.sources(), key=lambda entry: entry["file"]):
            place = self.place(entry["file"])
            made = os.path.relpath(os.path.normpath(pathlib.Path(entry["directory"]) / output_of(entry)), self.folder)
            if place.startswith(("build", ".cache", "tests/", "..")) or place in batch_of:
                continue
            batch = entry.pop("batch")
            commands.append(entry)
            batch_of[place] = batch and self.place(batch)
            if self.is_changed(place):
                own.append(place)
            elif all_of_them or made in objects:
                including.append(place)
        batches = [entry for entry in self.commands if self.place(entry["file"]) in batch_of.values()]
        (self.folder / "lint").mkdir(exist_ok=True)
        (self.folder / "lint/compile_commands.json").write_text(json.dumps(commands + batches))
        taken = own + including[:most]
        if most is None:
            return taken, len(taken), 0
        parts = {}
        for place in taken:
            parts.setdefault(batch_of[place] or place, []).append(place)
        return ([name if len(places) > 1 else places[0] for name, places in parts.items()], len(taken),
                len(own) + len(including) - len(taken))

    def tests(self, label, most_s=None):
        """(outputs to build, tests, tests that were left out)"""
        listed = subprocess.run(["ctest", "--test-dir", self.folder, "--show-only=json-v1"], capture_output=True,
                                text=True, check=True).stdout
        objects = set() if self.everything else self.objects()
        outputs = {line.split(":")[0] for line in self.ninja("-t", "targets", "all")}
        programs = sorted(name for name in outputs if re.fullmatch(r"bin/waymark(-[a-z]+)?", name))
        known, inputs = {}, {}

        def inputs_of(output):
            if output not in inputs:
                inputs[output] = self.ninja("-t", "inputs", output)
            return inputs[output]

        def is_touched(output):
            if output not in known:
                known[output] = self.everything or output in self.commands_changed or any(
                    name in objects or name in self.commands_changed or self.is_changed(self.place(name)) for name in inputs_of(output))
            return known[output]

        chosen = {}
        for test in json.loads(listed)["tests"]:
            labels = next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
            if (label not in labels) if label != "-" else ({"slow", "release-only"} & set(labels)):
                continue
            command = test.get("command", [])
            uses = {os.path.relpath(word, self.folder) for word in command if word.startswith(str(self.folder) + "/")}
            uses &= outputs
            is_script = not (command and os.path.relpath(command[0], self.folder) in outputs)
            if is_script:
                uses |= set(programs_of([word for word in command if word.startswith(str(ROOT) + "/tests/")], programs))
            scripts = [os.path.relpath(word, ROOT) for word in command if word.startswith(str(ROOT) + "/tests/")]
            own = test["name"] in self.tests_changed or is_script and any(
                name.startswith("config/") or any(os.path.dirname(name) == os.path.dirname(s) for s in scripts)
                for name in self.changed if not RULES.match(name))
            if self.everything or own or any(is_touched(name) for name in sorted(uses)):
                chosen[test["name"]] = uses
        made = {name: {o for output in uses for o in inputs_of(output) if o.endswith(".o")} for name, uses in chosen.items()}
        taken = within(made, most_s)
        return sorted(set().union(*(chosen[name] for name in taken))), taken, sorted(set(chosen) - set(taken))


def within(made, most_s):
    """Tests by their objects: the cheapest beyond what is made already, until the seconds are spent. All without a bound."""
    if most_s is None:
        return sorted(made)
    taken, have, spent_s, left = [], set(), 0.0, dict(made)
    while left:
        cost = {name: sum(next((s for end, s in OBJECT_S.items() if o.endswith(end)), 1.0) for o in objects - have) for name, objects in left.items()}
        name = min(sorted(left), key=cost.get)
        if spent_s + cost[name] > most_s:
            break
        spent_s += cost[name]
        have |= left.pop(name)
        taken.append(name)
    return sorted(taken)


def programs_of(scripts, programs):
    """The programs that scripts and their modules beside them name, as `waymark-eval` or as `waymark eval`. All, where a name is put together."""
    texts, todo = {}, [pathlib.Path(script) for script in scripts if pathlib.Path(script).is_file()]
    while todo:
        path = todo.pop()
        texts[path] = path.read_text(errors="ignore")
        beside = [path.with_name(f"{name}.py") for name in re.findall(r"^(?:import|from) (\w+)", texts[path], re.M)]
        todo += [other for other in beside if other.is_file() and other not in texts]
    text = "\n".join(texts.values())
    if not texts or re.search(r"waymark-[{$%]", text):
        return programs
    words = {name: name.removeprefix("bin/waymark").removeprefix("-") for name in programs}
    daemon = r"\"waymark\"|/waymark[\"'\s]|\$\{?waymark\b"
    return [name for name, word in words.items()
            if re.search(rf"waymark-{word}\b|waymark\S*[\"']?,?\s+[\"']?{word}\b" if word else daemon, text, re.I)]


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
    elif command == "lint" and len(arguments) in (2, 3):
        parts, taken, left = Build(*arguments[:2]).lint(*map(int, arguments[2:]))
        print(*parts, f"# {taken} {left}", sep="\n")
    elif command == "tests" and len(arguments) in (4, 5):
        outputs, names, left = Build(*arguments[:3]).tests(arguments[3], *map(float, arguments[4:]))
        if names or left:
            print(" ".join(outputs), "^(" + "|".join(re.escape(name) for name in names) + ")$" if names else "", " ".join(left), sep="\n")
    elif command == "skips" and arguments:
        skips(arguments)
    elif command == "passed" and not arguments:
        BASE_FILE.write_text(git("rev-parse", "HEAD") + "\n")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
