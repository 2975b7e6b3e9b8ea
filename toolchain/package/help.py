#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the manual pages and the shells' completions from the programs' --help.
help.py check|write BIN: `check` prints what differs and fails; `write` brings the files beside this one up to date. They are
kept as files because a package for another architecture can't run its programs."""
import difflib
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
TOOLS = ["batch", "bench", "calibrate", "compare", "detect", "diff", "eval", "hil", "import", "init", "map", "mine", "play", "reference", "report", "simulate", "web"]
OPTIONAL = ["ros2"]  # not built everywhere: a manual page, no completion of its options
PATHS = {"BOX", "PLAN", "BEFORE", "AFTER", "FILE", "FOLDER", "CONFIG", "RECORDING", "RUN", "REC", "OTHER", "LOG", "SCENARIO"}


class Help:
    """What one --help says: description, usage lines, (term, text) of positionals, options and subcommands, examples, rest."""

    def __init__(self, text):
        self.usage, self.about, self.terms, self.options, self.subcommands, self.examples, self.rest = [], [], [], [], [], [], []
        part = self.about

        def is_table():
            return any(part is table for table in (self.terms, self.options, self.subcommands))

        for line in text.rstrip().splitlines():
            low = line.lower().strip()
            if re.match(r"usage: ", low) or (self.usage and part is self.usage and line.startswith("       ")):
                self.usage.append(re.sub(r"^usage: ", "", line.strip(), flags=re.IGNORECASE))
                part = self.usage
            elif low.startswith("example"):
                part = self.examples
                after = line.split(":", 1)[1].strip()
                if after:
                    self.examples.append(after)
            elif low in ("positionals:", "positional arguments:", "options:", "subcommands:"):
                part = {"p": self.terms, "o": self.options, "s": self.subcommands}[low[0]]
            elif part is self.examples and line and not line.startswith("  "):
                part = self.rest
                part.append(line.strip())
            elif re.match(r"  \S", line) and part is not self.examples:
                if part is self.about or part is self.usage:
                    part = self.options
                term, said = re.match(r"  (.+?)(?:\s{2,}(.*))?$", line).groups()
                # A long term may leave one space alone before its text.
                short = re.match(r"(.*--\S+ [A-Z]+) ([a-z].+)", term)
                if short and not said:
                    term, said = short.groups()
                part.append([term, said or ""])
            elif re.match(r"\s{8,}\S", line) and is_table():
                part[-1][1] = (part[-1][1] + " " + line.strip()).strip()
            elif line.strip():
                if part is self.usage or is_table():
                    part = self.about
                part.append(line.strip())
        self.commands = [term for term, _ in self.options if re.fullmatch(r"[a-z0-9]+", term) and term not in TOOLS + OPTIONAL]

    def flags(self):
        """(name, value's name or None, text) of each option."""
        for term, said in self.options:
            # "--from S, --until S" are two options that share a text; "-h,--help" is one.
            for name, value in re.findall(r"(--[a-z][a-z-]*)(?: ([A-Z]+))?", term):
                yield name, value or None, said


def ask(binary, *words):
    done = subprocess.run([binary, *words, "--help"], capture_output=True, text=True, check=True)
    return Help(done.stdout)


# ── manual pages ─────────────────────────────────────────────────────────────────────────────────────────────────────
def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in ".'" else text


def terms(rows):
    out = [".Bl -tag -width indent"]
    for term, said in rows:
        out += [f".It {roff(term)}", roff(said) or "\\&"]
    return out + [".El"]


def body(help_):
    out = []
    if help_.usage:
        out += [".Bd -literal -compact", *map(roff, help_.usage), ".Ed", ".Pp"]
    out += [roff(line) for line in help_.about]
    for rows in (help_.terms, help_.options, help_.subcommands):
        if rows:
            out += terms(rows)
    if help_.rest:
        out += [".Pp", *map(roff, help_.rest)]
    if help_.examples:
        out += [".Pp", "Examples:", ".Bd -literal -offset indent -compact", *map(roff, help_.examples), ".Ed"]
    return out


def page(name, about, sections):
    out = ['.\\" SPDX-License-Identifier: Apache-2.0', '.\\" Made by toolchain/package/help.py from --help.',
           ".Dd November 21, 2026", f".Dt {name.upper()} 1", ".Os Waymark", ".Sh NAME", f".Nm {name}", f".Nd {about}"]
    for title, lines in sections:
        out += [f".Sh {title}", *lines]
    return "\n".join(out) + "\n"


def main_page(top, commands):
    description = ["Takes what wheels say over CAN and what cameras and other sensors see, and publishes poses over LCM.",
                   "Each command has a help text:", ".Nm", r".Ar command Fl \-help ."]
    parts = []
    for name, said in top.options:
        if name in commands:
            parts += [f".Ss waymark {name}: {roff(said)}", *body(commands[name])]
    files = [".Bl -tag -width indent",
             ".It Pa /etc/waymark/robot.yaml", "The robot's configuration, which the service runs.",
             ".It Pa /var/lib/waymark", "What the service keeps: the last pose, the black box.",
             ".It Pa /usr/share/doc/waymark/examples", "Configurations for other robots, and for public recordings.", ".El"]
    service = ["The package's service is not switched on by being installed: first the configuration has to be the robot's.",
               ".Bd -literal -offset indent", "waymark check /etc/waymark/robot.yaml",
               "waymark doctor /etc/waymark/robot.yaml", r"systemctl enable \-\-now waymark", ".Ed"]
    also = [", ".join(f".Xr waymark\\-{tool} 1" for tool in sorted(TOOLS + OPTIONAL)).replace(", .Xr", " ,\n.Xr")]
    return page("waymark", "localization of a robot on its own computer",
                [("SYNOPSIS", [".Nm", ".Ar command", ".Op Ar options"]), ("DESCRIPTION", description), ("COMMANDS", parts),
                 ("SERVICE", service), ("FILES", files),
                 ("EXIT STATUS", ["0: done; 1: the work failed; 2: usage or configuration."]), ("SEE ALSO", also)])


def tool_page(tool, top, subcommands):
    parts = body(top)
    for name, help_ in subcommands.items():
        parts += [f".Ss waymark {tool} {name}", *body(help_)]
    about = top.about[0].split(". ")[0].rstrip(".")
    usage = [".Nm waymark", f".Cm {tool}", ".Op Ar options"]
    return page(f"waymark-{tool}", roff(about[0].lower() + about[1:]),
                [("SYNOPSIS", usage), ("DESCRIPTION", parts), ("SEE ALSO", [".Xr waymark 1"])])


# ── completions ──────────────────────────────────────────────────────────────────────────────────────────────────────
def bash(words, options):
    cases = [f"    {' '.join(key)}) words='{' '.join(dict.fromkeys(name for name, _, _ in flags))}' ;;".replace(
        " ".join(key), '"' + " ".join(key) + '"', 1) for key, flags in options.items()]
    subs = {}
    for key in options:
        if len(key) == 2:
            subs.setdefault(key[0], []).append(key[1])
    nested = [f"    {tool}) [ \"$COMP_CWORD\" -eq 2 ] && more='{' '.join(names)}' ;;" for tool, names in subs.items()]
    return "\n".join([
        "# SPDX-License-Identifier: Apache-2.0", "# Made by toolchain/package/help.py from --help.", "_waymark() {",
        "  local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]:-} words= more=", "  COMPREPLY=()",
        "  if [ \"$COMP_CWORD\" -eq 1 ]; then",
        f"    mapfile -t COMPREPLY < <(compgen -W '{' '.join(words)} --help --version' -- \"$word\")", "    return", "  fi",
        "  case $command in", *nested, "  esac",
        "  case \"$command ${COMP_WORDS[2]:-}\" in", *(c for c in cases if c.split(chr(34))[1].count(" ") == 1),
        "  esac",
        "  [ -n \"$words\" ] || case \"$command\" in", *(c for c in cases if c.split(chr(34))[1].count(" ") == 0), "  esac",
        "  if [[ $word == -* ]]; then",
        "    mapfile -t COMPREPLY < <(compgen -W \"$words --help\" -- \"$word\")",
        "  elif [ -n \"$more\" ]; then", "    mapfile -t COMPREPLY < <(compgen -W \"$more\" -- \"$word\")",
        "  else", "    mapfile -t COMPREPLY < <(compgen -f -- \"$word\")", "  fi", "}",
        "complete -o filenames -F _waymark waymark"]) + "\n"


def zsh(words, options):
    def quoted(text):
        return re.sub(r"([\[\]:\\])", r"\\\1", text).replace("'", "'\\''")

    def specs(flags):
        for name, value, said in flags:
            files = "_files" if value in PATHS or value == "TEXT" else ""
            yield f"'{name}[{quoted(said)}]" + (f":{value.lower()}:{files}'" if value else "'")
    out = ["#compdef waymark", "# SPDX-License-Identifier: Apache-2.0", "# Made by toolchain/package/help.py from --help.",
           "_waymark() {", "  if (( CURRENT == 2 )); then", "    local -a commands=("]
    out += [f"      '{name}:{quoted(said)}'" for name, said in words.items()]
    out += ["    )", "    _describe command commands", "    return", "  fi", "  case $words[2] in"]
    for key, flags in options.items():
        if len(key) == 1:
            listed = " ".join(dict.fromkeys(specs(flags)))
            out.append(f"    {key[0]}) _arguments {listed} '*:file:_files' ;;")
    return "\n".join([*out, "    *) _files ;;", "  esac", "}", '_waymark "$@"']) + "\n"


def files(bin_):
    top = ask(bin_ / "waymark")
    commands = {name: ask(bin_ / "waymark", name) for name in top.commands if name != "help"}
    out = {"waymark.1": main_page(top, commands)}
    words = {name: said for name, said in top.options if name in commands}
    options = {(name,): list(help_.flags()) for name, help_ in commands.items()}
    for tool in TOOLS:
        help_ = ask(bin_ / f"waymark-{tool}")
        below = {name: ask(bin_ / f"waymark-{tool}", name) for name, _ in help_.subcommands}
        out[f"waymark-{tool}.1"] = tool_page(tool, help_, below)
        words[tool] = help_.about[0]
        for name, sub in below.items():
            options[tool, name] = list(sub.flags())
        options[(tool,)] = [*help_.flags(), *(flag for sub in below.values() for flag in sub.flags())]
    for tool in OPTIONAL:
        if (bin_ / f"waymark-{tool}").exists():
            out[f"waymark-{tool}.1"] = tool_page(tool, ask(bin_ / f"waymark-{tool}"), {})
    return {**{f"man/{name}": text for name, text in out.items()},
            "completion/waymark.bash": bash(words, options), "completion/_waymark": zsh(words, options)}


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("check", "write"):
        print("usage: help.py check|write BIN", file=sys.stderr)
        return 2
    differ = 0
    for name, text in files(pathlib.Path(sys.argv[2])).items():
        path = HERE / name
        if sys.argv[1] == "write":
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            differ += 1
            old = path.read_text().splitlines(True) if path.exists() else []
            sys.stdout.writelines(difflib.unified_diff(old, text.splitlines(True), str(path), "what --help says", n=0))
    if differ:
        print(f"{differ} files differ from --help: run `python3 toolchain/package/help.py write {sys.argv[2]}`")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
