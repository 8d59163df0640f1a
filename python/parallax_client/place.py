"""Where the deployments of this user are, which of them run, and a place among the programs that read one."""

import errno
import fcntl
import json
import os
import pathlib

from .errors import ClientError, Full, NotRunning, VersionMismatch

DESCRIPTION_VERSION = 1
"""Version of the description that a deployment gives of itself."""
SUPERVISOR = "supervisor"
"""Name of the process that runs a deployment, for the transport."""
MOST_GUESTS = 4
"""Programs that may read one deployment at the same time."""


def base():
    """The directory of the deployments of this user."""
    return pathlib.Path(f"/dev/shm/px-{os.getuid()}")


def root(name):
    """The directory of a deployment."""
    plain = name and len(name) <= 32 and not name.startswith(".")
    if not plain or not all(it.isascii() and (it.isalnum() or it in "-_.") for it in name):
        raise ClientError(
            f"deployment name {name!r} must be 1 to 32 characters of a-z, A-Z, 0-9, '-', '_', '.' and not begin with '.'"
        )
    return base() / name


def supervisor(folder):
    """The process that runs a deployment, from the kernel's list of locks; None if it does not run or is about to end.

    The list leaves out holders in other pid namespaces (containers): there it is the living process with the supervisor's
    name, with the process id that it has in its own.
    """
    if (folder / "ending").exists():
        return None
    try:
        about = os.stat(folder / "lock")
        # It comes page by page: where others lock and unlock meanwhile, a line may be passed over.
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
    except ImportError:  # the list of locks alone then
        return None
    file = folder / "config" / "iceoryx2.toml"
    if not file.exists():
        return None
    iceoryx2.set_log_level(iceoryx2.LogLevel.Fatal)
    try:
        config = iceoryx2.config.from_file(iceoryx2.FilePath.new(str(file)))
        nodes = iceoryx2.Node.list(iceoryx2.ServiceType.Ipc, config)
    except (iceoryx2.ConfigCreationError, iceoryx2.NodeListFailure):  # it ends meanwhile
        return None
    for node in nodes:
        details = node[0].details if isinstance(node, iceoryx2.NodeState.Alive) else None
        if details is not None and details.name.as_str() == SUPERVISOR:
            return details.process_id
    return None


def running_deployments():
    """The names of the deployments of this user that run."""
    try:
        folders = sorted(base().iterdir())
    except OSError:
        return []
    return [it.name for it in folders if it.is_dir() and supervisor(it) is not None]


def is_described(name):
    """Whether a deployment has said what it is."""
    return (root(name) / "deployment.json").exists()


def description(name):
    """What a running deployment says about itself, as a dictionary."""
    try:
        whole = json.loads((root(name) / "deployment.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise NotRunning(name, running_deployments()) from None
    own = whole.get("programs") if isinstance(whole, dict) else None
    if not isinstance(own, dict) or "format" not in own:
        raise ClientError(
            f"deployment {name!r} does not describe itself to other programs: it is of another version of Parallax"
        )
    if own["format"] != DESCRIPTION_VERSION:
        raise VersionMismatch(name, "description", own["format"], DESCRIPTION_VERSION)
    return own


class Seat:
    """A place among the programs that read a deployment: a locked file, which the system unlocks however this process ends."""

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
        """Gives the place to others."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
