# SPDX-License-Identifier: MIT
"""The cache folder, the lock between builders, and commands whose output goes to a log."""

import contextlib
import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path


class FirmwareError(Exception):
    """An image cannot be had; the text says what was tried and what to do."""


def cache_dir():
    """The folder that keeps images and sources: $PLUMB_CACHE, else ~/.cache/plumb."""
    path = Path(os.environ.get("PLUMB_CACHE") or Path.home() / ".cache" / "plumb")
    path.mkdir(parents=True, exist_ok=True)
    return path


def say(text):
    """A progress line."""
    print(f"firmware: {text}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def one_builder():
    """Only one process builds at a time; the others wait and then find what it made."""
    with open(cache_dir() / "lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("another process is building; waiting for it")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def run(step, *command, cwd=None, **variables):
    """Run a command; output to `<cache>/build.log`. FirmwareError with its last lines.

    `variables` are added to the environment.
    """
    log_path = cache_dir() / "build.log"
    say(f"{step} ...")
    began = time.monotonic()
    environment = {**os.environ, "LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive", **variables}
    with open(log_path, "ab") as log:
        log.write(f"\n== {step}: {' '.join(map(str, command))}\n".encode())
        log.flush()
        try:
            code = subprocess.run(
                command, cwd=cwd, env=environment, stdout=log, stderr=log, check=False
            ).returncode
        except FileNotFoundError as error:
            raise FirmwareError(f"{step}: there is no program {error.filename!r}") from None
    if code:
        tail = "\n".join(log_path.read_text(errors="replace").splitlines()[-15:])
        raise FirmwareError(f"{step} failed (exit code {code}):\n{tail}\nall of it: {log_path}")
    say(f"{step}: {time.monotonic() - began:.0f} s")


def publish(path, name):
    """Move a finished file into the cache under `name`, all at once."""
    target = cache_dir() / name
    staged = target.with_name(f"{name}.{os.getpid()}")
    staged.write_bytes(Path(path).read_bytes())
    staged.chmod(0o755)
    os.replace(staged, target)
    return target
