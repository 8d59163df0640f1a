"""What a run leaves: folders as NumPy arrays or pandas tables, and recordings message by message."""

import json
import pathlib

import numpy as np

from . import layout
from .errors import ClientError, VersionMismatch

SCHEMA_VERSION = 2
"""Version of the files of a run that this package reads."""


class Person:
    """One person of a finished run.

    id          identity within the run
    status      "ok", or why there is no skeleton, None in frames without the person, [frame]
    sides       "sure", "unsure" or "as-seen", None in frames without the person, [frame]
    joints      names of the joints
    positions   metres in the world of the calibration, NaN where there is none, [frame, joint, axis]
    covariance  square metres, NaN where there is no position, [frame, joint, axis, axis]
    reprojection_px  NaN where there is no position, [frame, joint]
    n_views     views that the joint was located with, [frame, joint]
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
        """Standard deviation of every joint along one axis, metres, NaN where there is no position: [frame, joint]."""
        return np.sqrt(np.trace(self.covariance, axis1=2, axis2=3) / 3)

    def joint(self, name):
        """Positions of one joint, [frame, axis] in metres."""
        if name not in self.joints:
            raise KeyError(f"no joint {name!r}, but {', '.join(self.joints)}")
        return self.positions[:, self.joints.index(name)]


class Run:
    """A finished run.

    frames      numbers of the frames, [frame]
    time_s      their times in the footage, NaN where no frame rate is known, [frame]
    status      "ok" if anybody has a skeleton, or why nobody has, or "no result", [frame]
    reason      why there is no result, [frame]
    joints      names of the joints
    people      every `Person` by identity
    followed    a `Person` made of whoever is followed in each frame, who may be one after the other
    summary     the contents of summary.json

    Of a run in which never two people are in a frame, `positions`, `covariance`, `reprojection_px`, `n_views`, `deviation`, `sides` and
    `joint()` are those of `followed`.
    """

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        if not folder.is_dir():
            raise ClientError(f"{folder} is no folder")
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
        identities = sorted({person["id"] for line in lines for person in line["people"]})
        self.people = {it: Person(it, self.joints, len(lines)) for it in identities}
        self.followed = Person(None, self.joints, len(lines))
        for row, line in enumerate(lines):
            for person in line["people"]:
                self.people[person["id"]]._put(row, person)
            for person in line["people"][:1]:
                self.followed._put(row, person)
        self._is_one = all(len(line["people"]) < 2 for line in lines)

    @property
    def only(self):
        """`followed`, of a run in which never two people are in a frame. Several are an error."""
        if not self._is_one:
            identities = ", ".join(str(it) for it in self.people)
            raise ClientError(f"{self.folder} has {len(self.people)} people: take one of `people`: {identities}")
        return self.followed

    positions = property(lambda self: self.only.positions)
    covariance = property(lambda self: self.only.covariance)
    reprojection_px = property(lambda self: self.only.reprojection_px)
    n_views = property(lambda self: self.only.n_views)
    deviation = property(lambda self: self.only.deviation)
    sides = property(lambda self: self.only.sides)

    def joint(self, name):
        """Positions of one joint of the only person, [frame, axis] in metres."""
        return self.only.joint(name)

    def to_pandas(self):
        """A table with one row for every person, frame and joint."""
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
            why = "the run has not ended, or was killed" if part else "it is no folder of a run"
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


def _json(where, text):
    try:
        return json.loads(text)
    except ValueError as error:
        raise ClientError(f"{where}: {error}") from None


def _problem(line):
    """What is wrong with a line; None if nothing is."""
    lacks = {"frame", "status", "people"} - set(line if isinstance(line, dict) else ())
    if lacks:
        return f"no {', '.join(sorted(lacks))}"
    people = line["people"]
    if len(people) > layout.LIMITS["MAX_PEOPLE"]:
        return f"{len(people)} people, a frame has at most {layout.LIMITS['MAX_PEOPLE']}"
    for nth, person in enumerate(people):
        lacks = {"id", "status", "joints"} - set(person if isinstance(person, dict) else ())
        if lacks:
            return f"person {nth} of the line has no {', '.join(sorted(lacks))}"
        if any(it["id"] == person["id"] for it in people[:nth]):
            return f"two people with id {person['id']}, ids of a frame differ"
    return None


def _names(lines):
    """The names of joints, of a set that this package does not know."""
    names = []
    for person in (person for line in lines for person in line["people"]):
        names.extend(it for it in person["joints"] if it not in names)
    return names


def read_folder(folder):
    """Reads the folder of a finished run as a `Run`."""
    return Run(folder)


def read_recording(file, about="skeletons"):
    """The messages of one kind in a recording (MCAP), one after the other, as pairs of its topic and the message.

    about: "skeletons", "people", "view-pose", "pair-pose", "view-quality" or "health". Needs the package `mcap`.
    """
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise ClientError("recordings need the package mcap: `pip install mcap`") from None
    kind = layout.TOPICS[about]
    if kind["elements"] is not None:
        raise ClientError(f"{about!r} carries arrays, which are not read from recordings here")
    dtype = layout.dtype(kind["message"])
    prefix = kind["name"].split("{}")[0]
    with open(file, "rb") as opened:
        for _, channel, message in make_reader(opened).iter_messages():
            if not channel.topic.lstrip("/").startswith(prefix):
                continue
            # The head of CDR has four bytes; a struct without padding has the layout that CDR asks for.
            data = message.data[4:]
            if about == "skeletons" and len(data) >= dtype.fields["people"][1]:
                # A recording holds the people that there are and no more.
                data = data.ljust(dtype.itemsize, b"\0")
            if len(data) < dtype.itemsize:
                raise ClientError(f"{file}: a message of {channel.topic} has {len(data)} bytes, {dtype.itemsize} are meant")
            yield channel.topic, np.frombuffer(data, dtype, count=1)[0]
