"""Directories of this user's deployments, running deployments, and the limited number of programs that read one."""

import errno
import fcntl
import json
import os
import pathlib

from .errors import ClientError, Full, NotRunning, VersionMismatch

DESCRIPTION_VERSION = 1
"""Version of a deployment's description of itself."""
SUPERVISOR = "supervisor"
"""Name in the transport of the process that runs a deployment."""
MOST_GUESTS = 4
"""Largest number of programs that may read one deployment at the same time."""


def base():
    """Returns the directory of this user's deployments."""
    return pathlib.Path(f"/dev/shm/px-{os.getuid()}")


def root(name):
    """Returns the directory of a deployment."""
    plain = name and len(name) <= 32 and not name.startswith(".")
    if not plain or not all(it.isascii() and (it.isalnum() or it in "-_.") for it in name):
        raise ClientError(
            f"deployment name {name!r} must be 1 to 32 characters of a-z, A-Z, 0-9, '-', '_', '.' and not begin with '.'"
        )
    return base() / name


def supervisor(folder):
    """Returns the id of the process that runs a deployment; None if the deployment is not running, or is about to end.

    The id comes from the kernel's list of locks. This list omits processes in other pid namespaces (containers). For these, the
    transport's list of processes is searched for the supervisor's name. The id is then the id in the other namespace.
    """
    if (folder / "ending").exists():
        return None
    try:
        about = os.stat(folder / "lock")
        # The kernel returns the list page by page. If locks change meanwhile, a line can be missing, so the list is read three times.
        lines = [line for _ in range(3) for line in pathlib.Path("/proc/locks").read_text().splitlines()]
    except OSError:
        return None
    place = f"{os.major(about.st_dev):02x}:{os.minor(about.st_dev):02x}:{about.st_ino}"
    for line in lines:
        words = line.split()
        if len(words) >= 6 and words[1] == "FLOCK" and words[5] == place:
            return int(words[4])
    return _elsewhere(folder)


def _elsewhere(folder):
    try:
        import iceoryx2
    except ImportError:  # only the list of locks is available then
        return None
    file = folder / "config" / "iceoryx2.toml"
    if not file.exists():
        return None
    iceoryx2.set_log_level(iceoryx2.LogLevel.Fatal)
    try:
        config = iceoryx2.config.from_file(iceoryx2.FilePath.new(str(file)))
        nodes = iceoryx2.Node.list(iceoryx2.ServiceType.Ipc, config)
    except (iceoryx2.ConfigCreationError, iceoryx2.NodeListFailure):  # the deployment has ended meanwhile
        return None
    for node in nodes:
        details = node[0].details if isinstance(node, iceoryx2.NodeState.Alive) else None
        if details is not None and details.name.as_str() == SUPERVISOR:
            return details.process_id
    return None


def running_deployments():
    """Returns the names of this user's running deployments."""
    try:
        folders = sorted(base().iterdir())
    except OSError:
        return []
    return [it.name for it in folders if it.is_dir() and supervisor(it) is not None]


def is_described(name):
    """Returns true if a deployment has written its description."""
    return (root(name) / "deployment.json").exists()


def description(name):
    """Returns the description of a running deployment, as a dictionary."""
    try:
        whole = json.loads((root(name) / "deployment.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise NotRunning(name, running_deployments()) from None
    own = whole.get("programs") if isinstance(whole, dict) else None
    if not isinstance(own, dict) or "format" not in own:
        raise ClientError(
            f"deployment {name!r} has no description for other programs: it runs another version of Parallax"
        )
    if own["format"] != DESCRIPTION_VERSION:
        raise VersionMismatch(name, "description", own["format"], DESCRIPTION_VERSION)
    return own


class Seat:
    """One of the limited number of places for programs that read a deployment.

    It is a locked file; the operating system unlocks it when this process ends.
    """

    def __init__(self, name):
        folder = root(name) / "guests"
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
        except OSError as error:
            if error.errno == errno.ENOENT:
                raise NotRunning(name, running_deployments()) from None
            raise
        guests = []
        for nth in range(MOST_GUESTS):
            path = folder / str(nth)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                os.close(self._file)
                guests.append("process " + path.read_text())
                continue
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, str(os.getpid()).encode(), 0)
            return
        self._file = None
        raise Full(name, MOST_GUESTS, guests)

    def leave(self):
        """Frees the place."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
