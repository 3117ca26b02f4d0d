"""The images: no root, no secrets, a root file system that may be read-only, a token for JupyterLab."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

PATIENCE = 1800  # s; ends what hangs, and is far from anything that a busy machine does
ROOT = Path(__file__).parents[1]
DOCKERFILE = ROOT / "docker" / "Dockerfile"
pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(not DOCKERFILE.is_file(), reason="no checkout: the Dockerfile is not installed"),
]


def instructions(stage: str) -> list[tuple[str, str]]:
    """Return the instructions of a stage of the Dockerfile, continued lines joined."""
    text = re.sub(r"^\s*#.*\n", "", DOCKERFILE.read_text(), flags=re.MULTILINE).replace("\\\n", " ")
    found: dict[str, list[tuple[str, str]]] = {}
    name = ""
    for line in filter(str.strip, text.splitlines()):
        word, _, rest = line.strip().partition(" ")
        if word == "FROM":
            name = rest.split()[-1]
        found.setdefault(name, []).append((word, rest.strip()))
    return found[stage]


def environment(*stages: str) -> dict[str, str]:
    """Return the variables that the stages set."""
    texts = [rest for stage in stages for word, rest in instructions(stage) if word == "ENV"]
    return dict(pair.split("=", 1) for text in texts for pair in text.split())


def jupyter_command() -> list[str]:
    """Return the command that the jupyter image starts."""
    (command,) = (rest for word, rest in instructions("jupyter") if word == "CMD")
    return list(json.loads(command))


def test_jupyter_image_is_not_root() -> None:
    """The last user is not root, and JupyterLab is not told to accept root or to go without a token."""
    users = [rest for word, rest in instructions("jupyter") if word == "USER"]
    assert users
    assert users[-1] not in ("root", "0")
    words = " ".join(jupyter_command())
    assert not re.search(r"allow-root|token|password|disable_check_xsrf|allow_origin", words)


def test_no_secrets_in_the_image() -> None:
    """What the host lends is mounted for one instruction; nothing else names a secret, and git's folder stays out."""
    for stage in ("run", "full", "dev", "docs", "jupyter"):
        for word, rest in instructions(stage):
            assert word in ("FROM", "RUN", "ENV", "COPY", "WORKDIR", "USER", "EXPOSE", "CMD", "ENTRYPOINT"), word
            if word == "RUN":
                targets = re.findall(r"--mount=type=(\w+)", rest)
                assert set(targets) <= {"secret"}
                assert "/run/secrets" not in re.sub(r"--mount=\S+", "", rest)
            elif word != "FROM":
                assert not re.search(r"token|password|secret|proxy|credential", rest, re.IGNORECASE), rest
    ignored = (ROOT / ".dockerignore").read_text().splitlines()
    assert {".git", "results", "docker"} <= set(ignored)


def test_jupyter_image_writes_below_tmp() -> None:
    """With --read-only --tmpfs /tmp -v results: what programs write for themselves goes below /tmp."""
    variables = environment("run", "full", "jupyter")
    names = [name for name in variables if name.startswith(("XDG", "MPL", "IPYTHON", "JUPYTER"))]
    assert len(names) >= 5
    assert all(variables[name].startswith("/tmp/") for name in names)
    assert variables["PYTHONDONTWRITEBYTECODE"] == "1"


def answer(port: int, path: str) -> tuple[int, str]:
    """Return status and last address of a request."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=PATIENCE) as response:
            return response.status, response.url
    except urllib.error.HTTPError as error:
        return error.code, error.url


@pytest.mark.skipif(shutil.which("jupyter-lab") is None, reason="JupyterLab is not installed")
def test_jupyterlab_asks_for_its_token(tmp_path: Path) -> None:
    """The image's own command and variables: 403 without the token and with a wrong one, 200 with it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    variables = {k: v.replace("/tmp/", f"{tmp_path}/") for k, v in environment("jupyter").items()}
    command = [f"--port={port}" if word.startswith("--port") else word for word in jupyter_command()]
    command = ["--ip=127.0.0.1" if word.startswith("--ip") else word for word in command]
    root = ["--allow-root"] if os.getuid() == 0 else []  # here, not in the image
    log = tmp_path / "log"
    with log.open("w") as out:
        process = subprocess.Popen(
            [*command, *root], stdout=out, stderr=subprocess.STDOUT, cwd=tmp_path, env={**os.environ, **variables}
        )
        try:
            deadline = time.monotonic() + PATIENCE
            while not (found := re.search(r"token=(\w{40,})", log.read_text())):
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.2)
            assert answer(port, "/api/contents")[0] == 403
            assert answer(port, f"/api/contents?token={'0' * 48}")[0] == 403
            assert "/login" in answer(port, "/lab")[1]
            assert answer(port, f"/api/contents?token={found[1]}")[0] == 200
        finally:
            process.terminate()
            process.wait(timeout=PATIENCE)


READ_ONLY = """
set -e
mkdir "$1/root"
mount --bind / "$1/root"
mount -o remount,bind,ro "$1/root"
mount -t tmpfs -o mode=1777 tmpfs "$1/root/tmp"
mount --rbind /dev "$1/root/dev"
mount --rbind /proc "$1/root/proc"
mkdir "$1/root/tmp/fenwear" "$1/root/tmp/results"
mount --bind "$2" "$1/root/tmp/fenwear"
mount -o remount,bind,ro "$1/root/tmp/fenwear"
mount --bind "$1/results" "$1/root/tmp/results"
exec chroot --userspec=1000:1000 "$1/root" env --chdir=/tmp PYTHONPATH=/tmp/fenwear HOME=/nowhere \
    XDG_CACHE_HOME=/tmp/cache MPLCONFIGDIR=/tmp/cache/matplotlib PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1 "$3" -c '
import os, subprocess, sys
assert os.getuid() == 1000
try:
    open("/written", "w")
except OSError as error:
    assert error.strerror in ("Read-only file system", "Permission denied"), error
else:
    raise SystemExit("the root file system can be written")
words = ["-m", "fenwear", "run", "example1", "-o", "results/run", "--set", "run.half_cycles=4"]
sys.exit(subprocess.run([sys.executable, *words]).returncode)
'
"""


@pytest.mark.slow
def test_run_without_root_on_a_read_only_system(tmp_path: Path) -> None:
    """As user 1000, only /tmp and a mounted folder of results can be written: a run, with its forms compiled."""
    permitted = os.getuid() == 0 and shutil.which("unshare") is not None
    if not permitted or subprocess.run(["unshare", "--mount", "true"], capture_output=True, check=False).returncode:
        pytest.skip("a mount namespace is not permitted here; needs root and CAP_SYS_ADMIN")
    (tmp_path / "results").mkdir()
    os.chown(tmp_path / "results", 1000, 1000)
    command = ["unshare", "--mount", "sh", "-c", READ_ONLY, "sh", str(tmp_path), str(ROOT), sys.executable]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "run" / "summary.json").stat().st_uid == 1000


def test_every_command_of_fenwear_is_one_of_the_launcher() -> None:
    """So that `docker/fenwear COMMAND` is never looked for among the programs of the image."""
    from fenwear.cli import app

    names = {c.name or c.callback.__name__ for c in app.registered_commands if c.callback}  # type: ignore[union-attr]
    text = (ROOT / "docker" / "fenwear").read_text()
    usage, known = (
        text.partition("END\n}")[0],
        text.partition("inner_directory\n        case $1 in")[2].partition("esac")[0],
    )
    for name in names:
        assert re.search(rf"\b{name}\b", usage), name
        assert re.search(rf"\b{name}\b", known), name


STUB = """#!/bin/sh
[ "$1" = run ] || exit 0
for word; do
    [ "$before" = --workdir ] && workdir=$word
    case $word in --volume=*) echo "${word#--volume=}" ;; esac
    before=$word
done
echo "$workdir"
"""


@pytest.fixture
def shown(tmp_path: Path) -> Callable[..., Any]:
    """Return shown(folder, *command): what docker/fenwear would mount and where it would start, or its refusal."""
    engine = tmp_path / "engine" / "docker"
    engine.parent.mkdir()
    engine.write_text(STUB)
    engine.chmod(0o755)
    variables = {
        "PATH": f"{engine.parent}:{os.environ['PATH']}",
        "FENWEAR_ENGINE": "docker",
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }
    launcher = tmp_path / "checkout" / "docker" / "fenwear"
    launcher.parent.mkdir(parents=True)
    shutil.copy(ROOT / "docker" / "fenwear", launcher)
    shutil.copy(DOCKERFILE, launcher.parent)

    def shown(folder: Path, *command: object) -> tuple[dict[Path, Path], Path] | str:
        words = [str(launcher), *map(str, command)]
        env = {**os.environ, **variables}
        done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, timeout=PATIENCE, check=False)
        if done.returncode:
            return done.stderr
        *volumes, workdir = done.stdout.splitlines()
        pairs = [volume.split(":")[:2] for volume in volumes]
        return {Path(inside): Path(outside) for outside, inside in pairs}, Path(workdir)

    return shown


def inside(path: Path, mounts: dict[Path, Path]) -> Path | None:
    """Return what an absolute path without links means inside: a file of this machine, or None."""
    for target in sorted(mounts, key=lambda target: len(target.parts), reverse=True):
        if path.is_relative_to(target):
            return mounts[target] / path.relative_to(target)
    return None


@pytest.fixture
def places(tmp_path: Path) -> Path:
    """Return a folder with a case in one folder, its geometry in another, and links."""
    for name in ("work/deep", "cases", "geometry", "elsewhere", "far"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "cases" / "own.toml").write_text(
        'base = "../work/base.toml"\n[geometry]\nfile = "../geometry/own.geo"\n'
    )
    (tmp_path / "work" / "base.toml").write_text('base = "../cases/own.toml"\n')  # in a circle: fenwear refuses it
    (tmp_path / "work" / "link").symlink_to("../elsewhere/link")
    (tmp_path / "elsewhere" / "link").symlink_to(tmp_path / "far")
    (tmp_path / "work" / "round").symlink_to("round")
    return tmp_path


NAMED = {
    "new": (("run", "example1", "-o", "../elsewhere/new/x"), ["elsewhere/new/x"]),
    "absolute": (("run", "example1", "-o", "{}/elsewhere/out"), ["elsewhere/out"]),
    "joined": (("run", "example1", "-o../elsewhere/out"), ["elsewhere/out"]),
    "with an equals sign": (("run", "example1", "--output=../elsewhere/out"), ["elsewhere/out"]),
    "link": (("run", "example1", "-o", "link/out"), ["elsewhere", "far/out"]),
    "case": (("check", "../cases/own.toml"), ["cases/own.toml", "geometry/own.geo", "work/base.toml"]),
    "setting": (("check", "example1", "--set", 'geometry.file="../geometry/own.geo"'), ["geometry/own.geo"]),
    "compare": (("compare", "../far", "-o", "../elsewhere/x.png"), ["far", "elsewhere/x.png"]),
    "mesh": (("mesh", "example1", "-o", "../elsewhere/x.msh"), ["elsewhere/x.msh"]),
    "ranks": (("mpirun", "-n", "2", "python3", "-m", "fenwear", "run", "example1", "-o", "../far/x"), ["far/x"]),
    "another program": (("python3", "../cases/script.py", "/usr/share/x", "../far"), ["cases/script.py", "far"]),
}


@pytest.mark.parametrize("name", NAMED)
def test_what_a_command_names_is_visible(name: str, shown: Callable[..., Any], places: Path) -> None:
    """Under its own name, and seen from the same directory, so that it means the same as outside."""
    words, expected = NAMED[name]
    mounts, workdir = shown(places / "work", *(word.format(places) if "{}" in word else word for word in words))
    assert workdir == places / "work"
    for path in ("work/x", *expected):
        assert inside(places / path, mounts) == places / path
    assert inside(places / "engine", mounts) is None


@pytest.mark.parametrize(
    "path", ["/usr/share/out", "/etc/out", "/new/out", "/home/out", "../../../../../../../../../proc/x", "round/out"]
)
def test_what_cannot_be_visible_is_refused(path: str, shown: Callable[..., Any], places: Path) -> None:
    """Before anything is computed."""
    for words in (("run", "example1", "-o", path), ("mesh", "example1", f"--output={path}"), ("check", path)):
        refusal = shown(places / "work", *words)
        assert f"{path} cannot be shown inside the container" in refusal


def test_the_checkout_is_its_own_and_fenwear(shown: Callable[..., Any], places: Path) -> None:
    """Paths mean the same in the checkout as anywhere else; the package is imported from /fenwear."""
    mounts, workdir = shown(places / "checkout" / "docker", "run", "example1", "-o", "../../far/x")
    assert workdir == places / "checkout" / "docker"
    for path in ("checkout/results", "far/x"):
        assert inside(places / path, mounts) == places / path
    assert mounts[Path("/fenwear")] == places / "checkout"


COMPLETE = """
source "$1/docker/completion.bash"
shift
COMP_CWORD=$1
shift
COMP_WORDS=("$@")
_fenwear_words
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["fenwear", "st"], ["steady"]),
        (["fenwear", "--b"], ["--build"]),
        (["fenwear", "test", "-"], ["--fast", "--on", "--wheel"]),
        (["fenwear", "docs", ""], ["--show"]),
        (["fenwear", "info", "motion.am"], ["/fenwear 2 fenwear info motion.am"]),
    ],
)
@pytest.mark.parametrize("built", [True, False])
def test_completion_of_the_launcher(words: list[str], expected: list[str], built: bool, tmp_path: Path) -> None:
    """Commands come from the launcher at once, all else from fenwear, where there is an image: none is built for it."""
    engine = tmp_path / "docker"
    engine.write_text(
        "#!/bin/sh\n"
        f'case $1 in image) exit {0 if built else 1} ;; build) touch "$0.built" ;; run) ;; *) exit 0 ;; esac\n'
        "while [ $# -gt 0 ]; do\n"
        "    case $1 in --workdir) at=$2 ;; COMP_WORDS=*) text=${1#*=} ;;\n"
        '    COMP_CWORD=*) echo "$at ${1#*=} $text" ;; esac\n'
        "    shift\ndone\n"
    )
    engine.chmod(0o755)
    variables = {
        "PATH": f"{tmp_path}:{os.environ['PATH']}",
        "FENWEAR_ENGINE": "docker",
        "XDG_CACHE_HOME": str(tmp_path),
    }
    command = ["bash", "-c", COMPLETE, "bash", str(ROOT), str(len(words) - 1), *words]
    env = {**os.environ, **variables}
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=PATIENCE, check=True)
    from_fenwear = words[1] == "info"
    assert done.stdout.split("\n")[:-1] == (expected if built or not from_fenwear else [""])
    assert not (tmp_path / "docker.built").exists()


def test_every_command_is_completed(tmp_path: Path) -> None:
    """An empty first word gives all that the usage names."""
    done = subprocess.run(
        [str(ROOT / "docker" / "fenwear"), "--complete", "1", "fenwear", ""],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    )
    from fenwear.cli import app

    names = {c.name or c.callback.__name__ for c in app.registered_commands if c.callback}  # type: ignore[union-attr]
    assert names | {"test", "lint", "docs", "--build", "--suite", "--help"} == set(done.stdout.split())
