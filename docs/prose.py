"""Checks the prose of pages, messages and docstrings for `docker/fenwear lint`: length, turns of phrase, proselint.

Messages are the strings of the package but for docstrings; in these a semicolon ends a sentence. Prints file:line with
the finding and what to write instead, and exits with 1 where there is one. `--count` prints the number of sentences of
each page, and how many of them are too long. docs/prose.toml has the settings.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from proselint.checks import __register__ as all_checks
from proselint.registry import CheckRegistry
from proselint.tools import LintFile
from textstat import textstat

ROOT = Path(__file__).resolve().parents[1]
SETTINGS = tomllib.loads((ROOT / "docs" / "prose.toml").read_text("utf-8"))

# A dot behind a single capital letter ends no sentence where it is an initial, but does behind a unit, as in "3 K.".
END = re.compile(r"(?:(?<=\d [A-Z]\.)|(?<=°C\.)|(?<!\b[A-Z]\.)(?<=[.!?]))[)\"*]*\s+(?=[\"(*$\[]*(?:[A-Z0-9]|fenwear))")
BREAK = re.compile(r"\n|(?<=[.!?;])\s+")  # between sentences of a message
ITEM = re.compile(r"\s*(?:[-*+]|\d+\.)\s+")
# Code, formulas that stand by themselves, comments, lists of sources, the head of a file.
NO_PROSE = re.compile(
    r"^(`{3,}).*?^\1|^\$\$.*?\$\$$|^## Sources$.*?(?=^#|\Z)|<!--.*?-->|\A---\n.*?^---$", re.MULTILINE | re.DOTALL
)
NO_LINE = re.compile(r" {4}|\s*(#|\||!\[|\(\w+\)=|\+\+\+)")
FORMULA = re.compile(r"\$\$.+?\$\$|\$[^$]+\$", re.DOTALL)
# These become one word; of a link its text stays.
WORDS = (re.compile(r"(`+)[^`]+?\1"), re.compile(r"\$[^$]+\$"), re.compile(r"\[\]\([^)]*\)"))
TARGET = re.compile(r"\]\([^)]*\)")


@dataclass(frozen=True)
class Paragraph:
    """A paragraph or an item of a list, with the page's line of each of its characters."""

    text: str
    lines: tuple[int, ...]

    def sentences(self) -> Iterator[tuple[int, str]]:
        """Yield the line at which each sentence begins, and the sentence."""
        begin = 0
        for end in (*(match.end() for match in END.finditer(self.text)), len(self.text)):
            if sentence := self.text[begin:end].strip():
                yield self.lines[begin], sentence
            begin = end


def paragraphs(text: str) -> Iterator[Paragraph]:
    """Yield the paragraphs of a page without code, tables, headings, comments and displayed formulas."""
    text = NO_PROSE.sub(lambda match: "\n" * match[0].count("\n"), text)
    gathered: list[tuple[int, str]] = []
    for number, line in enumerate([*text.split("\n"), ""], 1):
        prose = bool(line.strip()) and not NO_LINE.match(line)
        item = ITEM.match(line)
        if gathered and (item or not prose):
            yield _joined(gathered)
            gathered = []
        if prose:
            gathered.append((number, line[item.end() if item else 0 :].strip()))


def _joined(gathered: list[tuple[int, str]]) -> Paragraph:
    """Return the paragraph of some lines with code, formulas and references as one word each."""
    text = "".join(f"{line} " for _, line in gathered)
    lines = [number for number, line in gathered for _ in range(len(line) + 1)]
    for pattern, word in (*((pattern, "Code") for pattern in WORDS), (TARGET, "")):
        for match in reversed([*pattern.finditer(text)]):
            text = text[: match.start()] + word + text[match.end() :]
            lines[match.start() : match.end()] = [lines[match.start()]] * len(word)
    return Paragraph(text, tuple(lines))


def read(page: Path) -> str:
    """Return the text of a page; of a notebook's script its cells of Markdown, on their lines."""
    lines = page.read_text("utf-8").split("\n")
    if page.suffix == ".py":
        prose = False
        for at, line in enumerate(lines):
            prose = "[markdown]" in line if line.startswith("# %%") else prose
            lines[at] = line[2:] if prose and not line.startswith("# %%") else ""
    return "\n".join(lines)


def pages() -> list[Path]:
    """Return the pages that the check reads."""
    return sorted({path for pattern in SETTINGS["pages"] for path in ROOT.glob(pattern)})


def messages(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each string below a node of the syntax tree, without docstrings."""
    if isinstance(node, ast.Constant | ast.JoinedStr):
        yield node.lineno, _text(node)
    elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        for part in ast.iter_child_nodes(node):
            yield from messages(part)


def _text(node: ast.AST) -> str:
    """Return the text of a string, with a number in place of each value that is filled in."""
    if isinstance(node, ast.JoinedStr):
        return "".join(map(_text, node.values))
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else "1"


def words(sentence: str) -> int:
    """Return the number of words of a sentence."""
    return int(textstat.lexicon_count(sentence, removepunct=True))


def of_sentence(line: int, sentence: str) -> Iterator[tuple[int, str]]:
    """Yield the findings in a sentence: its length, and turns of phrase."""
    if (length := words(sentence)) > SETTINGS["longest"]:
        yield line, f"{length} words; write at most {SETTINGS['longest']} in a sentence: {sentence[:60]}..."
    yield from turns(line, sentence)


def turns(line: int, sentence: str) -> Iterator[tuple[int, str]]:
    """Yield the banned turns of phrase in a sentence."""
    for pattern, advice in SETTINGS["banned"].items():
        for match in re.finditer(pattern, sentence):
            yield line, f'"{match[0]}": {advice}'


def findings_in_code(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the description of each finding in the strings and docstrings of a module."""
    tree = ast.parse(source)
    for line, text in messages(tree):
        for sentence in BREAK.split(text):
            yield from of_sentence(line, sentence)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
            for sentence in re.split(r"\n\s*(?:\w+:)?\s*|(?<=[.:;])\s+", text):
                yield from turns(node.body[0].lineno, sentence)


def findings(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the description of each finding on a page."""
    checks = {"max_errors": 99, "checks": dict.fromkeys(SETTINGS["proselint"], True)}
    for paragraph in paragraphs(text):
        for line, sentence in paragraph.sentences():
            yield from of_sentence(line, sentence)
        for found in LintFile("page", paragraph.text).lint(checks):
            at = min(max(found.check_result.span[0] - 1, 0), len(paragraph.lines) - 1)
            yield paragraph.lines[at], f"{found.check_result.message} ({found.check_result.check_path})"
    for formula in FORMULA.finditer(re.sub(r"^```.*?^```", lambda m: "\n" * m[0].count("\n"), text, flags=re.M | re.S)):
        for pattern, advice in SETTINGS["formulas"].items():
            if match := re.search(pattern, formula[0]):
                yield text[: text.index(formula[0])].count("\n") + 1, f"{match[0]}: {advice}"


def count() -> None:
    """Print the number of sentences of each page and how many of them are too long."""
    total = long = 0
    for page in pages():
        lengths = [words(s) for paragraph in paragraphs(read(page)) for _, s in paragraph.sentences()]
        over = sum(length > SETTINGS["longest"] for length in lengths)
        total, long = total + len(lengths), long + over
        print(f"{page.relative_to(ROOT)}: {len(lengths)} sentences, {over} long")
    print(f"in all: {total} sentences, {long} of more than {SETTINGS['longest']} words")


def check() -> int:
    """Print the findings on all pages and in all messages, and return the exit status."""
    CheckRegistry().register_many(all_checks)
    modules = [path for pattern in SETTINGS["modules"] for path in ROOT.glob(pattern)]
    found = [(page, *finding) for page in pages() for finding in findings(read(page))]
    found += [(path, *finding) for path in sorted(modules) for finding in findings_in_code(path.read_text("utf-8"))]
    for path, line, finding in found:
        print(f"{path.relative_to(ROOT)}:{line}: {finding}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(count() if "--count" in sys.argv else check())
