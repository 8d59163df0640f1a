"""Read-only access to Parallax: running deployments, folders of finished runs, recordings.

    import parallax_client

    with parallax_client.connect("demo") as client:
        for moment in client.moments(patience=5):
            for person in moment.people:
                wrist = person.joint("right wrist")
                print(moment.frame, person.id, wrist.position, wrist.deviation, wrist.reason)

Live messages need the package `iceoryx2` in the version that the deployment was built with. Folders do not need it.
"""

from .errors import ClientError, Full, NotRunning, VersionMismatch
from .files import Person, Run, read_folder, read_recording
from .layout import LIMITS, STATUSES, TOPICS, dtype, reason
from .live import Client, Joint, Moment, Picture, Skeleton, connect, running_deployments

__all__ = [
    "Client", "ClientError", "Full", "Joint", "LIMITS", "Moment", "NotRunning", "Person", "Picture", "Run",
    "STATUSES",
    "Skeleton", "TOPICS", "VersionMismatch", "connect", "dtype", "read_folder", "read_recording", "reason", "running_deployments",
]
__version__ = "0.2.0"
