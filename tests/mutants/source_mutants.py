# SPDX-License-Identifier: Apache-2.0
"""Mutations of C and C++ sources: one wrong sign, bound, operator, constant or missing statement each. They rely on clang-format's
layout: binary operators have a space on either side. Comments, strings and preprocessor lines stay as they are."""
import re
from dataclasses import dataclass

# What is replaced by what. Each match is a mutant; `\b` and spaces keep templates, includes and pointers out.
RULES = [
    ("sign", re.compile(r"(?<=[\w)\]]) \+ (?=[\w(\-*&])"), " - "),
    ("sign", re.compile(r"(?<=[\w)\]]) - (?=[\w(\-*&])"), " + "),
    ("sign", re.compile(r"(?<=[(,=] )-(?=[\w(])|(?<=return )-(?=[\w(])|(?<=\()-(?=[\w(])"), ""),
    ("sign", re.compile(r" \+= "), " -= "),
    ("sign", re.compile(r" -= "), " += "),
    ("factor", re.compile(r"(?<=[\w)\]]) \* (?=[\w(])"), " / "),
    ("factor", re.compile(r"(?<=[\w)\]]) / (?=[\w(])"), " * "),
    ("factor", re.compile(r" \*= "), " /= "),
    ("bound", re.compile(r"(?<=[\w)\]]) < (?=[\w(\-*&])"), " <= "),
    ("bound", re.compile(r"(?<=[\w)\]]) <= (?=[\w(\-*&])"), " < "),
    ("bound", re.compile(r"(?<=[\w)\]]) > (?=[\w(\-*&])"), " >= "),
    ("bound", re.compile(r"(?<=[\w)\]]) >= (?=[\w(\-*&])"), " > "),
    ("condition", re.compile(r"(?<=[\w)\]]) < (?=[\w(\-*&])"), " >= "),
    ("condition", re.compile(r"(?<=[\w)\]]) > (?=[\w(\-*&])"), " <= "),
    ("condition", re.compile(r" == "), " != "),
    ("condition", re.compile(r" != "), " == "),
    ("condition", re.compile(r" && "), " || "),
    ("condition", re.compile(r" \|\| "), " && "),
    ("condition", re.compile(r"(?<=[( ])!(?=[\w(])"), ""),
    ("constant", re.compile(r"(?<![\w.])0\.5(?![\w.])"), "1.0"),
    ("constant", re.compile(r"(?<![\w.])2(\.0)?(?= \*)"), "3"),
    ("constant", re.compile(r"(?<=[+\-] )1(?![\w.])"), "2"),
    ("constant", re.compile(r"(?<![\w.])1e([369])(?![\w.])"), r"2e\1"),
    ("statement", re.compile(r"^\s+[\w.\[\]>()*\-]+ [+\-*/|&]?= [^;{}]*;$"), ""),
    ("statement", re.compile(r"^\s+[\w.:\->]+\([^;{}]*\);$"), ""),
]
DECLARES = re.compile(r"^\s*(const|auto|static|constexpr|return|using|typedef|enum|struct|class|template|friend|double|float|int|bool|char|size_t|u?int\d+_t|wm_\w+)\b")
TEMPLATE = re.compile(r"(template|static_cast|std::|Eigen::|[Vv]ec|[Mm]at\w*|array|span|optional)\s*<")


@dataclass(frozen=True)
class Mutant:
    """A line of a file with one change."""
    file: str
    line: int  # from 1
    kind: str
    before: str
    after: str

    def name(self):
        return f"{self.file}:{self.line} {self.kind}: {self.before.strip()}  ->  {self.after.strip() or '(nothing)'}"


def code_of(lines):
    """For each line what of it is code: comments and strings are blanks of the same length."""
    out, in_comment = [], False
    for line in lines:
        if line.lstrip().startswith("#") and not in_comment:
            out.append("")
            continue
        text, i, quote = list(line), 0, ""
        while i < len(line):
            two = line[i:i + 2]
            if in_comment:
                text[i] = " "
                if two == "*/":
                    text[i:i + 2], in_comment, i = "  ", False, i + 1
            elif quote:
                text[i] = "\0"
                if line[i] == "\\":
                    i += 1
                    if i < len(line):
                        text[i] = "\0"
                elif line[i] == quote:
                    quote = ""
            elif two == "//":
                text[i:] = " " * (len(line) - i)
                break
            elif two == "/*":
                text[i:i + 2], in_comment, i = "  ", True, i + 1
            elif line[i] in "\"'" and not (line[i] == "'" and i and line[i - 1].isdigit()):
                quote, text[i] = line[i], "\0"
            i += 1
        out.append("".join(text))
    return out


def mutants_of(file, text):
    """All mutants of a file's text, in the order of its lines."""
    lines, out = text.split("\n"), []
    for number, (line, code) in enumerate(zip(lines, code_of(lines)), 1):
        if not code.strip() or "tatic_assert" in code:
            continue
        for kind, pattern, replacement in RULES:
            if kind == "statement":
                found = pattern.match(code.rstrip())
                if found and not DECLARES.match(code):
                    out.append(Mutant(file, number, kind, line, ""))
                continue
            if kind in ("bound", "condition") and "<" in pattern.pattern and TEMPLATE.search(code):
                continue
            for found in pattern.finditer(code):
                after = line[:found.start()] + found.expand(replacement) + line[found.end():]
                out.append(Mutant(file, number, kind, line, after))
    return out


def apply(text, mutant):
    lines = text.split("\n")
    assert lines[mutant.line - 1] == mutant.before, "the file has changed"
    lines[mutant.line - 1] = mutant.after
    return "\n".join(lines)
