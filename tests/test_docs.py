"""The pages: every file, command and block of code on them is taken from their text and executed, page by page.

A block of commands (`sh`, `console`) or Python runs as a reader would run it, in order, in one folder for each page.
"Save this as `name`" before a block makes it a file. What a `console` block shows is what the command prints, without
what stands for "...". A comment above a block says that it is slow, or why it is not run. Runs end with a report and an
uncertainty, which have tests of their own, on the pages for a start and on those that show them.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts), *ROOT.glob("*.md")])
BLOCK = re.compile(
    r"(?:<!-- (?P<mark>slow|not run: [^\n]+) -->\n)?^```(?P<kind>sh|console|python|toml|text|c)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
PATIENCE = 1800  # s; ends what hangs, and is far from anything that a busy machine does
# What docker/fenwear does with its words: fenwear's own commands are its, others run as they are. Those on one rank,
# and scripts, are forked from a process that has the modules loaded (tests/forked.py).
SHIM = f"""#!/bin/sh
forked="{sys.executable} -IS {ROOT}/tests/forked.py DOOR"
case " $* " in *" -- "*) forked="{sys.executable}" ;; esac
case $1 in
  run) shift && exec $forked -m fenwear run LEFT_OUT "$@" ;;
  steady|optimum|shape|check|mesh|sheet|plot|compare|verify|validate|sensitivity|calibrate|life|sweep|export|flash|info|import|new|schema)
    exec $forked -m fenwear "$@" ;;
  python3) case $2 in *.py) shift && exec $forked "$@" ;; esac ;;
esac
exec "$@"
"""


START = ("README", "first-steps")  # pages whose runs are as a reader's, to the last figure
SHOWN = {"report": r"report|figures|fenwear plot|\.png", "uncertainty": r"uncertain|accuracy"}


@dataclass(frozen=True)
class Block:
    """A block of a page: its language, text, mark, and the name of the file that it is saved as."""

    kind: str
    text: str
    mark: str
    saved: str


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page."""
    text, found = page.read_text("utf-8"), []
    for match in BLOCK.finditer(text):
        before = re.search(r"(?:^|\n\n)((?:(?!\n\n).)*)\n*$", text[: match.start()].rstrip("\n"), re.DOTALL)
        name = re.findall(r"[Ss]ave (?:this|it) as\s+`([^`]+)`", before[1]) if before else []
        found.append(Block(match["kind"], match["text"], match["mark"] or "", name[-1] if name else ""))
    return found


def _pages() -> Iterator[object]:
    for page in PAGES:
        found = [b for b in blocks(page) if not b.mark.startswith("not run")]
        if any(b.kind in ("sh", "console", "python") for b in found):
            marks = [pytest.mark.process, *([pytest.mark.slow] if any(b.mark == "slow" for b in found) else [])]
            yield pytest.param(page, id=page.relative_to(ROOT).with_suffix("").as_posix(), marks=marks)


@pytest.mark.parametrize("page", _pages())
def test_page(page: Path, tmp_path: Path, forks: str) -> None:
    """All that a page shows works, in the order in which it stands, and prints what the page says."""
    tools, folder = tmp_path / "tools", tmp_path / "reader"
    (tools / "docker").mkdir(parents=True)
    folder.mkdir()
    script = SHIM.replace("DOOR", forks).replace("LEFT_OUT", _left_out(page))
    for shim in (tools / "fenwear", folder / "docker" / "fenwear"):
        shim.parent.mkdir(exist_ok=True)
        shim.write_text(script)
        shim.chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    del environment["FENWEAR_KEPT_GIB"]  # as for a reader, set-ups are kept from one command to the next

    def done(command: str) -> str:
        command = command.replace("/fenwear/demos", f"{ROOT}/demos")
        result = subprocess.run(
            ["bash", "-euc", command],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert result.returncode == 0, f"{command}\n{result.stdout}{result.stderr}"
        return result.stdout + result.stderr

    for block in blocks(page):
        if block.saved:
            (folder / block.saved).write_text(block.text, "utf-8")
        if block.mark.startswith("not run"):
            continue
        if block.kind == "python":
            if not block.saved:
                (folder / "block.py").write_text(block.text, "utf-8")
            done(f"fenwear python3 {block.saved or 'block.py'}")
        elif block.kind == "sh":
            done(block.text)
        elif block.kind == "console":
            for command, shown in _sessions(block.text):
                _compare(shown, done(command), command)


def _left_out(page: Path) -> str:
    """Return the options by which runs leave out what no command of the page asks for and no output shows."""
    text = "".join(block.text for block in blocks(page) if block.kind in ("sh", "console"))
    left = [key for key, words in SHOWN.items() if page.stem not in START and not re.search(words, text)]
    return " ".join(f"--set output.{key}=false" for key in left)


def _sessions(text: str) -> list[tuple[str, list[str]]]:
    """Return the commands of a console block with what it shows of their output."""
    sessions: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        if line.startswith("$ "):
            sessions.append((line[2:], []))
        else:
            sessions[-1][1].append(line)
    return sessions


def _compare(shown: list[str], printed: str, command: str) -> None:
    """Check that the lines shown are printed in this order; without "..." between them one after the other.

    What comes through mpirun has no order: it may exchange what a process writes one after the other.
    """
    if "mpirun" in command:
        for line in shown:
            assert line == "..." or line in printed, f"{command} does not print:\n{line}\nbut:\n{printed}"
        return
    lines = [line.rstrip() for line in printed.replace("\r", "\n").splitlines()]
    at, anywhere = 0, False
    for line in shown:
        if line == "...":
            anywhere = True
            continue
        assert line in lines[at:], f"{command} does not print:\n{line}\nbut:\n{printed}"
        place = lines.index(line, at)
        assert anywhere or place == at or at == 0, f"{command}: something is printed before:\n{line}"
        at, anywhere = place + 1, False


def test_every_block_is_run_or_says_why() -> None:
    """No block of commands is of a language that nothing runs; reasons are reasons."""
    for page in PAGES:
        text = page.read_text("utf-8")
        kinds = set(re.findall(r"^```([a-z]+)$", text, re.MULTILINE))
        assert kinds <= {"sh", "console", "python", "toml", "text", "c"}, page
        assert all(len(b.mark) > 15 for b in blocks(page) if b.mark.startswith("not run"))
        for block in blocks(page):
            if block.kind in ("toml", "text", "c") and page.name != "CHANGELOG.md":
                assert block.saved, f"{page}: a file without a name:\n{block.text}"


def test_links_lead_somewhere() -> None:
    """Every link of the pages that are read without being built is to a file that is there."""
    for page in ROOT.glob("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text("utf-8")):
            assert target.startswith("https://") or (page.parent / target).exists(), f"{page}: {target}"
