#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the documents' prose: prose.py [FILE...], by default README, CONTRIBUTING, SECURITY, config/README.md, docs/ without generated
pages, and the changelog's section [Unreleased]. Rules are those of prose.yaml and proselint: length of sentences (but of dated reports), terms of
the glossary, words that a program is not said to do, one line for each change. Code, links' addresses and HTML are no prose."""
import pathlib
import re
import sys

try:
    import yaml
    from markdown_it import MarkdownIt
    from proselint.checks import __register__ as PROSELINT_CHECKS
    from proselint.config import DEFAULT
    from proselint.registry import CheckRegistry
    from proselint.tools import LintFile
except ImportError as missing:
    print(f"skipped: {missing.name} is not in .cache/venv (tests/judges/setup.sh)")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
GENERATED = {"docs/config.md", "docs/errors.md"}
CHANGE_LENGTH = 160  # characters of a line of the changelog

RULES = yaml.safe_load((HERE / "prose.yaml").read_text())
MARKDOWN = MarkdownIt("commonmark").enable("table")
SENTENCE = re.compile(r"(?<=[.!?])[\"')]*\s+(?=[\"'(]*[A-Z0-9])")
PART = re.compile(r"(?<=[.!?:;])[\"')]*\s+")


def compiled(rules):
    return [(re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])", re.IGNORECASE), advice) for pattern, advice in rules.items()]


TERMS, WORDS = compiled(RULES["terms"]), compiled(RULES["words"])


def blocks(text):
    """(line, prose) of each paragraph, heading, item and cell."""
    for token in MARKDOWN.parse(text):
        if token.type == "inline":
            parts = []
            for child in token.children:
                if child.type == "text":
                    parts.append(child.content)
                elif child.type == "code_inline":
                    parts.append(f"Code{len(parts)}")  # one word
                elif child.type in ("softbreak", "hardbreak"):
                    parts.append("\n")
            yield token.map[0] + 1, "".join(parts)


def words(text):
    return sum(1 for word in text.split() if re.search(r"[A-Za-z]", word))


def too_long(line, text):
    begin = 0
    for sentence in SENTENCE.split(text):
        begin = max(text.find(sentence, begin), 0)
        at = line + text.count("\n", 0, begin)
        if words(sentence) > RULES["limits"]["sentence_words"]:
            yield at, f"{words(sentence)} words in a sentence: {' '.join(sentence.split()[:8])} ..."
        else:
            for part in PART.split(sentence):
                if words(part) > RULES["limits"]["part_words"]:
                    yield at, f"{words(part)} words without a stop: {' '.join(part.split()[:8])} ..."


def wrong_words(line, text):
    for rules, what in ((TERMS, "the glossary's term is"), (WORDS, "better:")):
        for pattern, advice in rules:
            for found in pattern.finditer(text):
                yield line + text.count("\n", 0, found.start()), f"'{found[0]}': {what} {advice}"


def by_proselint(line, text):
    off = {path: False for path in RULES["proselint_off"]}  # first: the deeper path counts
    enabled = off | {path: on for path, on in DEFAULT["checks"].items() if path not in off}
    for result in LintFile("text", text).lint({"max_errors": 100, "checks": enabled}):
        found = result.check_result
        if found.check_path == "lexical_illusions" and len(text[found.span[0] - 1:found.span[1]].split()[0]) == 1:
            continue  # a product of matrices
        yield line + result.pos[0] - 2, f"{found.check_path}: {found.message}"


def faults(text, rules=(too_long, wrong_words, by_proselint)):
    """(line, message) of each fault in a text of Markdown."""
    for line, prose in blocks(text):
        if not prose.strip():
            continue  # an empty cell
        for rule in rules:
            yield from rule(line, prose)


def long_changes(text):
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("- ") and len(line) > CHANGE_LENGTH:
            yield number, f"{len(line)} characters in a change; {CHANGE_LENGTH} are enough"
        elif line.startswith(" "):
            yield number, "a change has one line"


def unreleased(text):
    """The changelog without what earlier versions had; lines keep their numbers."""
    return re.split(r"^## \[\d", text, maxsplit=1, flags=re.MULTILINE)[0]


def check_rules():
    """The rules see a planted fault of each kind, and the glossary has the terms that they ask for."""
    glossary = (ROOT / "docs/glossary.md").read_text().lower()
    for term in RULES["terms"].values():
        assert term.lower() in glossary, f"prose.yaml: '{term}' is not in the glossary"
    planted = "One two three four five six seven eight nine ten " * 3 + ". The filter believes it.\n\nA time shift.\n\nVery unique.\n\nOne that drove no more than so many metres of way."
    seen = " ".join(message for _, message in faults(planted))
    for what in ("words without a stop", "believes", "time offset", "uncomparables", "One that", "no more than", "so many", "of way"):
        assert what in seen, f"prose.py does not find a planted fault: {what}"
    assert len(list(long_changes("- " + "a " * CHANGE_LENGTH + "\n  more\n"))) == 2


def documents():
    named = ["README.md", "CONTRIBUTING.md", "SECURITY.md", "config/README.md", "CHANGELOG.md"]
    yield from (ROOT / name for name in named)
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if str(path.relative_to(ROOT)) not in GENERATED:
            yield path


def main():
    CheckRegistry().register_many(PROSELINT_CHECKS)
    check_rules()
    paths = [pathlib.Path(name).resolve() for name in sys.argv[1:]] or list(documents())
    count = 0
    for path in paths:
        text = path.read_text()
        # Reports are the notes of their day: their sentences stay as long as they are.
        found = faults(text, (wrong_words, by_proselint)) if path.parent.name == "reports" else faults(text)
        if path.name == "CHANGELOG.md":
            text = unreleased(text)
            found = [*faults(text), *long_changes(text)]
        for line, message in sorted(found):
            print(f"{path.relative_to(ROOT)}:{line}: {message}")
            count += 1
    print(f"{len(paths)} documents, {count} faults")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
