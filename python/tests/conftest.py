"""Fixtures: a deployment of synthetic cameras, and a finished run. Both need the executable: PARALLAX, or a build in target/."""

import os
import pathlib
import shutil
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def _executable():
    named = os.environ.get("PARALLAX")
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    for path in [named, target / "release" / "parallax", target / "debug" / "parallax", shutil.which("parallax")]:
        if path and pathlib.Path(path).is_file():
            return str(path)
    return None


@pytest.fixture(scope="session")
def executable():
    found = _executable()
    if found is None:
        pytest.skip("there is no executable of Parallax: set PARALLAX, or build it")
    return found


class Deployment:
    """`parallax demo` with a unique name."""

    def __init__(self, executable, folder, seconds, name=None):
        self.name = name or f"py-{os.getpid()}-{time.monotonic_ns() % 100000}"
        self.folder = folder
        self.process = subprocess.Popen(
            [executable, "demo", "--name", self.name, "--out", str(folder), "--seconds", str(seconds), "--rate", "2",
             "--no-kill", "-q"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )

    def pids(self, service):
        """Returns the processes of a service."""
        found = []
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = path.read_bytes().split(b"\0")
            except OSError:
                continue
            is_service = len(words) > 2 and words[1:3] == [b"service", service.encode()]
            if is_service and str(self.folder).encode() in b" ".join(words):
                found.append(int(path.parent.name))
        return found

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()


@pytest.fixture(scope="session")
def live():
    """Skips the test if the transport is not installed."""
    pytest.importorskip("iceoryx2", reason="the package iceoryx2 is not installed")


@pytest.fixture
def deploy(executable, live, tmp_path):
    """Starts deployments, and stops them."""
    started = []

    # Longer than any test on a busy machine. Each deployment is stopped when its test ends.
    def start(seconds=1800, name=None):
        made = Deployment(executable, tmp_path / f"out-{len(started)}", seconds, name)
        started.append(made)
        return made

    yield start
    for it in started:
        it.stop()
