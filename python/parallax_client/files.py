"""Files of a run: folders as NumPy arrays or pandas tables, and recordings message by message."""

import json
import pathlib

import numpy as np

from . import layout
from .errors import ClientError, VersionMismatch

SCHEMA_VERSION = 2
"""Version of the files of a run that this package reads."""


class Person:
    """One person in a finished run.

    id          identity within the run
    status      "ok", or the reason for a missing skeleton; None in frames without the person, [frame]
    sides       certainty of left and right: "sure", "unsure" or "as-seen"; None in frames without the person, [frame]
    joints      names of the joints
    positions   positions in the world of the calibration, in metres; NaN for a missing joint, [frame, joint, axis]
    covariance  covariance of the positions, in square metres; NaN for a missing joint, [frame, joint, axis, axis]
    reprojection_px  reprojection error, in pixels; NaN for a missing joint, [frame, joint]
    n_views     number of views from which the joint was located, [frame, joint]
    """

    def __init__(self, identity, joints, n_frames):
        n, m = n_frames, len(joints)
        self.id, self.joints = identity, joints
        self.status = np.full(n, None, dtype=object)
        self.sides = np.full(n, None, dtype=object)
        self.positions = np.full((n, m, 3), np.nan)
        self.covariance = np.full((n, m, 3, 3), np.nan)
        self.reprojection_px = np.full((n, m), np.nan)
        self.n_views = np.zeros((n, m), dtype=int)

    def _put(self, row, line):
        self.status[row], self.sides[row] = line["status"], line.get("sides")
        for name, joint in line["joints"].items():
            if name not in self.joints or "position_m" not in joint:
                continue
            at = self.joints.index(name)
            self.positions[row, at] = joint["position_m"]
            xx, xy, xz, yy, yz, zz = joint["covariance_m2"]
            self.covariance[row, at] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            reprojection = joint.get("reprojection_px")
            self.reprojection_px[row, at] = np.nan if reprojection is None else reprojection
            self.n_views[row, at] = len(joint["views"])

    @property
    def deviation(self):
        """Standard deviation of every joint along one axis, in metres; NaN for a missing joint, [frame, joint]."""
        return np.sqrt(np.trace(self.covariance, axis1=2, axis2=3) / 3)

    def joint(self, name):
        """Returns the positions of one joint, in metres, [frame, axis]."""
        if name not in self.joints:
            raise KeyError(f"there is no joint {name!r}; the joints are {', '.join(self.joints)}")
        return self.positions[:, self.joints.index(name)]


class Run:
    """A finished run.

    frames      numbers of the frames, [frame]
    time_s      times of the frames in the footage, in seconds; NaN if the frame rate is unknown, [frame]
    status      "ok" if there is a skeleton, otherwise the reason for its absence or "no result", [frame]
    reason      reason for a missing result, [frame]
    joints      names of the joints
    people      all people (`Person`) by identity who have a position in any frame
    followed    a `Person` with the data of the followed person in each frame; the followed person can change
    summary     contents of summary.json

    If no frame has more than one person, `positions`, `covariance`, `reprojection_px`, `n_views`, `deviation`, `sides` and
    `joint()` are also available on the run, with the data of `followed`.
    """

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        if not folder.is_dir():
            raise ClientError(f"{folder} is not a folder")
        self.folder = folder
        self.summary = self._summary()
        lines = self._lines()
        known = layout.JOINT_SETS.get(self.summary.get("joints"))
        self.joints = list(known or _names(lines))
        self.frames = np.array([it["frame"] for it in lines], dtype=np.int64)
        time = [it.get("time_s") for it in lines]
        self.time_s = np.array([np.nan if it is None else it for it in time], dtype=float)
        self.status = np.array([it["status"] for it in lines], dtype=object)
        self.reason = np.array([it.get("reason") for it in lines], dtype=object)
        identities = sorted({person["id"] for line in lines for person in line["people"] if _has_position(person)})
        self.people = {it: Person(it, self.joints, len(lines)) for it in identities}
        self.followed = Person(None, self.joints, len(lines))
        for row, line in enumerate(lines):
            for person in line["people"]:
                if person["id"] in self.people:
                    self.people[person["id"]]._put(row, person)
            for person in line["people"][:1]:
                self.followed._put(row, person)
        self._is_one = all(len(line["people"]) < 2 for line in lines)

    @property
    def only(self):
        """Returns `followed` if no frame has more than one person; otherwise raises an error."""
        if not self._is_one:
            identities = ", ".join(str(it) for it in self.people)
            raise ClientError(f"{self.folder} has {len(self.people)} people; use one of them from `people`: {identities}")
        return self.followed

    positions = property(lambda self: self.only.positions)
    covariance = property(lambda self: self.only.covariance)
    reprojection_px = property(lambda self: self.only.reprojection_px)
    n_views = property(lambda self: self.only.n_views)
    deviation = property(lambda self: self.only.deviation)
    sides = property(lambda self: self.only.sides)

    def joint(self, name):
        """Returns the positions of one joint of the only person, in metres, [frame, axis]."""
        return self.only.joint(name)

    def to_pandas(self):
        """Returns a table with one row for each person, frame and joint."""
        try:
            import pandas
        except ImportError:
            raise ClientError("tables need the package pandas: `pip install pandas`") from None
        n, m = len(self.frames), len(self.joints)

        def rows(person):
            return pandas.DataFrame({
                "frame": np.repeat(self.frames, m), "time_s": np.repeat(self.time_s, m), "person": person.id,
                "status": np.repeat(self.status, m), "joint": self.joints * n,
                "x_m": person.positions[..., 0].ravel(), "y_m": person.positions[..., 1].ravel(),
                "z_m": person.positions[..., 2].ravel(), "deviation_m": person.deviation.ravel(),
                "reprojection_px": person.reprojection_px.ravel(), "n_views": person.n_views.ravel(),
            })

        people = list(self.people.values()) or [self.followed]
        return pandas.concat([rows(it) for it in people], ignore_index=True)

    def _summary(self):
        path = self.folder / "summary.json"
        if not path.exists():
            part = (self.folder / "pose3d.jsonl.part").exists()
            why = "the run has not ended, or was killed" if part else "this is not the folder of a run"
            raise ClientError(f"{path} does not exist: {why}")
        summary = _json(path, path.read_text(encoding="utf-8"))
        version = summary.get("schema_version") if isinstance(summary, dict) else None
        if version != SCHEMA_VERSION:
            raise VersionMismatch(str(self.folder), "files of a run", version, SCHEMA_VERSION)
        return summary

    def _lines(self):
        path = self.folder / "pose3d.jsonl"
        if not path.exists():
            raise ClientError(f"{path} does not exist")
        lines = []
        with path.open(encoding="utf-8") as file:
            for nth, text in enumerate(file, 1):
                line = _json(f"{path}, line {nth}", text)
                problem = _problem(line)
                if problem:
                    raise ClientError(f"{path}, line {nth}: {problem}")
                lines.append(line)
        return lines


def _has_position(person):
    return any("position_m" in joint for joint in person["joints"].values())


def _json(where, text):
    try:
        return json.loads(text)
    except ValueError as error:
        raise ClientError(f"{where}: {error}") from None


def _problem(line):
    """Returns the problem of a line; None if the line is valid."""
    lacks = {"frame", "status", "people"} - set(line if isinstance(line, dict) else ())
    if lacks:
        return f"missing fields: {', '.join(sorted(lacks))}"
    people = line["people"]
    if len(people) > layout.LIMITS["MAX_PEOPLE"]:
        return f"the frame has {len(people)} people, but the limit is {layout.LIMITS['MAX_PEOPLE']}"
    for nth, person in enumerate(people):
        lacks = {"id", "status", "joints"} - set(person if isinstance(person, dict) else ())
        if lacks:
            return f"person {nth} of the line has missing fields: {', '.join(sorted(lacks))}"
        if any(it["id"] == person["id"] for it in people[:nth]):
            return f"two people have the id {person['id']}, but ids in a frame must differ"
    return None


def _names(lines):
    """Returns the names of the joints in a run with an unknown joint set."""
    names = []
    for person in (person for line in lines for person in line["people"]):
        names.extend(it for it in person["joints"] if it not in names)
    return names


def read_folder(folder):
    """Reads the folder of a finished run, and returns a `Run`."""
    return Run(folder)


def read_recording(file, about="skeletons"):
    """Yields the messages of one kind in a recording (MCAP), as pairs of topic and message. Needs the package `mcap`.

    about: "skeletons", "people", "sightings", "pair-pose", "view-quality" or "health".
    """
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise ClientError("recordings need the package mcap: `pip install mcap`") from None
    kind = layout.TOPICS[about]
    if kind["elements"] is not None:
        raise ClientError(f"messages {about!r} contain arrays, which this package does not read from recordings")
    dtype = layout.dtype(kind["message"])
    prefix = kind["name"].split("{}")[0]
    with open(file, "rb") as opened:
        for _, channel, message in make_reader(opened).iter_messages():
            if not channel.topic.lstrip("/").startswith(prefix):
                continue
            # The header of CDR has four bytes. A struct without padding has the layout that CDR requires.
            data = message.data[4:]
            if about == "skeletons" and len(data) >= dtype.fields["people"][1]:
                # A recording only contains the people in the frame, not the whole array.
                data = data.ljust(dtype.itemsize, b"\0")
            if len(data) < dtype.itemsize:
                raise ClientError(f"{file}: a message of {channel.topic} has {len(data)} bytes instead of {dtype.itemsize}")
            yield channel.topic, np.frombuffer(data, dtype, count=1)[0]
