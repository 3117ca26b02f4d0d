"""The check of the pages' prose in `docker/fenwear lint`: length of sentences, banned turns of phrase, proselint.

Prints file:line, the finding and what to write instead, and exits with 1 where there is one. `--count` prints the
sentences of each page and how many of them are long. docs/prose.toml has the settings.
"""

from __future__ import annotations

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

# Ends of sentences: a dot behind a single capital letter or an abbreviation is none.
END = re.compile(r"(?<!\b[A-Z]\.)(?<!\bNo\.)(?<!\bvol\.)(?<!\bpp\.)(?<=[.!?])[)\"*]*\s+(?=[\"(*$\[]*(?:[A-Z0-9]|fenwear))")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+\.)\s+")


@dataclass(frozen=True)
class Paragraph:
    """A paragraph or an item of a list: its text, and the page's line of each of its characters."""

    text: str
    lines: tuple[int, ...]

    def sentences(self) -> Iterator[tuple[int, str]]:
        """Yield the line at which each sentence begins, and the sentence."""
        at = 0
        for end in [*(match.end() for match in END.finditer(self.text)), len(self.text)]:
            if self.text[at:end].strip():
                yield self.lines[at], self.text[at:end].strip()
            at = end


def paragraphs(text: str) -> Iterator[Paragraph]:
    """Yield the paragraphs of a page without code, tables, headings, comments, directives and formulas on their own."""
    text = re.sub(r"^(`{3,}).*?^\1|^\$\$.*?\$\$$|^## Sources$.*?(?=^#|\Z)|<!--.*?-->|\A---\n.*?^---$", _blank, text, flags=re.MULTILINE | re.DOTALL)
    gathered: list[tuple[int, str]] = []
    for number, line in enumerate([*text.split("\n"), ""], 1):
        prose = line.strip() and not re.match(r"\s*(#|\||!\[|\(\w+\)=|:::)", line)
        if (not prose or ITEM.match(line)) and gathered:
            yield _joined(gathered)
            gathered = []
        if prose:
            gathered.append((number, ITEM.sub("", line, count=1).strip()))


def _blank(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


def _joined(gathered: list[tuple[int, str]]) -> Paragraph:
    """Return a paragraph in which code and formulas are one word each, and links are their text."""
    text, lines = "", []
    for number, line in gathered:
        text += line + " "
        lines += [number] * (len(line) + 1)
    for pattern in (r"(`+)[^`]+?\1", r"\$[^$]+\$", r"\]\([^)]*\)"):
        for match in reversed([*re.finditer(pattern, text)]):
            word = "" if match[0][0] == "]" and text[match.start() - 1] != "[" else "Code"
            text = text[: match.start()] + word + text[match.end() :]
            lines[match.start() : match.end()] = lines[match.start() : match.start() + len(word)]
    return Paragraph(text, tuple(lines))


def pages() -> list[Path]:
    """Return the pages that the check reads."""
    found = {path for pattern in SETTINGS["pages"] for path in ROOT.glob(pattern)}
    return sorted(found - {path for pattern in SETTINGS["except"] for path in ROOT.glob(pattern)})


def words(sentence: str) -> int:
    """Return the number of words of a sentence."""
    return int(textstat.lexicon_count(sentence, removepunct=True))


def findings(page: Path) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each finding on a page."""
    longest = SETTINGS["longest"]
    for paragraph in paragraphs(page.read_text("utf-8")):
        for line, sentence in paragraph.sentences():
            if (length := words(sentence)) > longest:
                yield line, f"{length} words; write sentences of at most {longest}: {sentence[:60]}..."
        for pattern, advice in SETTINGS["banned"].items():
            for match in re.finditer(pattern, paragraph.text):
                yield paragraph.lines[match.start()], f'"{match[0].strip()}": {advice}'
        for found in LintFile("page", paragraph.text).lint({"max_errors": 99, "checks": CHECKS}):
            result = found.check_result
            at = min(max(result.span[0] - 1, 0), len(paragraph.lines) - 1)
            yield paragraph.lines[at], f"{result.message} ({result.check_path})"


CHECKS = dict.fromkeys(SETTINGS["proselint"], True)


def main() -> int:
    """Check the pages, or count their sentences."""
    CheckRegistry().register_many(all_checks)
    status = 0
    if "--count" in sys.argv:
        total = long = 0
        for page in pages():
            lengths = [words(s) for p in paragraphs(page.read_text("utf-8")) for _, s in p.sentences()]
            over = sum(length > SETTINGS["longest"] for length in lengths)
            total, long = total + len(lengths), long + over
            print(f"{page.relative_to(ROOT)}: {len(lengths)} sentences, {over} long, at most {max(lengths, default=0)} words")
        print(f"in all: {total} sentences, {long} of more than {SETTINGS['longest']} words")
        return 0
    for page in pages():
        for line, text in findings(page):
            print(f"{page.relative_to(ROOT)}:{line}: {text}")
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
