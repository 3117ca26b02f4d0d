"""Commands in processes forked from one that has fenwear loaded: each has its own memory, folder and exit status.

What a fresh interpreter needs two seconds for is done once. As a program, this is the server (`forked.py SOCKET`) or
sends it the rest of its command line (`forked.py SOCKET -m fenwear ...`, or a script) with its own folder, environment
and standard streams, and ends with the status that comes back.
"""

from __future__ import annotations

import array
import json
import os
import socket
import sys

LENGTH = 8  # bytes that tell how long a request is


def call(address: str, arguments: list[str], folder: str, environment: dict[str, str], streams: list[int]) -> int:
    """Run a command line with these descriptors for input, output and errors; return its exit status."""
    with socket.socket(socket.AF_UNIX) as link:
        link.connect(address)
        request = json.dumps([arguments, folder, environment]).encode()
        rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", streams))]
        link.sendmsg([len(request).to_bytes(LENGTH, "big")], rights)
        link.sendall(request)
        answer = link.recv(LENGTH)
    return int.from_bytes(answer, "big") if answer else 1


def serve(address: str) -> None:
    """Load everything, then fork for each request until the starter's end of standard input is closed."""
    import select

    _load()
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(address + ".new")
        door.listen()
        os.rename(address + ".new", address)  # who sees it finds it open
        while door in select.select([door, sys.stdin], [], [])[0]:
            link, _ = door.accept()
            if os.fork() == 0:
                door.close()
                _answer(link)
            link.close()
            _reap()


def _load() -> None:
    import petsc4py
    from mpi4py import MPI  # noqa: F401

    petsc4py.init([sys.argv[0], "-no_signal_handler"])
    import matplotlib.figure  # noqa: F401
    import pint  # noqa: F401
    import xarray  # noqa: F401

    import fenwear.cli
    import fenwear.studies.run  # noqa: F401


def _reap() -> None:
    try:
        while os.waitpid(-1, os.WNOHANG) != (0, 0):
            pass
    except ChildProcessError:
        pass


def _answer(link: socket.socket) -> None:
    """In a child: fork once more, so that the status of whatever ends there, by a signal too, is told."""
    size = array.array("i", [0] * 3)
    head, rights, _, _ = link.recvmsg(LENGTH, socket.CMSG_SPACE(size.itemsize * 3))
    streams = array.array("i")
    streams.frombytes(rights[0][2])
    length, text = int.from_bytes(head, "big"), b""
    while len(text) < length:
        text += link.recv(length - len(text))
    child = os.fork()
    if child == 0:
        link.close()
        _become(*json.loads(text), list(streams))
    for stream in streams:
        os.close(stream)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    link.sendall((status if status >= 0 else 128 - status).to_bytes(LENGTH, "big"))
    os._exit(0)


def _become(arguments: list[str], folder: str, environment: dict[str, str], streams: list[int]) -> None:
    """Run a command line as a fresh interpreter would."""
    import ctypes
    import runpy
    import traceback

    for descriptor, stream in enumerate(streams):
        os.dup2(stream, descriptor)
        os.close(stream)
    sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w", buffering=1)  # noqa: SIM115
    sys.__stdin__, sys.__stdout__, sys.__stderr__ = sys.stdin, sys.stdout, sys.stderr
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    status: object = 0
    try:
        if arguments[0] == "-m":
            sys.argv = arguments[1:]
            sys.path.insert(0, folder)
            runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
        else:
            sys.argv = arguments
            sys.path.insert(0, os.path.dirname(os.path.abspath(arguments[0])))
            runpy.run_path(arguments[0], run_name="__main__")
    except SystemExit as end:
        status = end.code
    except BaseException:
        traceback.print_exc()
        status = 1
    if isinstance(status, str):
        print(status, file=sys.stderr)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    ctypes.CDLL(None).fflush(None)  # what libraries in C have printed
    os._exit(status if isinstance(status, int) else int(status is not None))


if __name__ == "__main__":
    if len(sys.argv) == 2:
        serve(sys.argv[1])
    else:
        sys.exit(call(sys.argv[1], sys.argv[2:], os.getcwd(), dict(os.environ), [0, 1, 2]))
