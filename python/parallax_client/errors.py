"""Errors that occur when deployments and files are read."""


class ClientError(Exception):
    """A deployment or a file cannot be read; the message says why."""


class NotRunning(ClientError):
    """The deployment is not running. `running` has the names of the running deployments."""

    def __init__(self, name, running):
        self.name, self.running = name, list(running)
        ones = "running: " + ", ".join(self.running) if self.running else "no deployment is running"
        super().__init__(f"deployment {name!r} is not running; {ones}")


class VersionMismatch(ClientError):
    """The deployment sends a version of a message that this package does not read."""

    def __init__(self, name, what, theirs, ours):
        self.what, self.theirs, self.ours = what, theirs, ours
        super().__init__(
            f"deployment {name!r} sends {what!r} version {theirs}, but this package reads version {ours}: "
            "install the package from the same version of Parallax"
        )


class Full(ClientError):
    """The maximum number of programs is already reading the deployment."""

    def __init__(self, name, most, guests):
        self.most = most
        super().__init__(
            f"{most} programs are already reading deployment {name!r}, which is the limit: {', '.join(guests)}"
        )
