"""Live skeletons, poses and pictures of a running deployment."""

import collections
import threading
import time

import numpy as np

from . import layout
from .errors import ClientError, NotRunning
from .place import running_deployments
from .transport import Guest, TooManyHeld

__all__ = ["Client", "Joint", "Moment", "Picture", "Skeleton", "connect", "running_deployments"]

_PAUSE_S = 0.002
_CHECK_S = 0.1
_RETRY_S = 0.2
_MOST_PENDING = 32


class Joint(collections.namedtuple("Joint", "name position covariance deviation reprojection_px n_views status")):
    """One joint.

    `position` is in metres, `covariance` (3x3) in square metres, and `deviation` is the standard deviation along one axis in
    metres. They are None for a missing joint; then `reason` is a text.
    """

    __slots__ = ()

    @property
    def reason(self):
        """Reason for a missing position; None if the joint has a position."""
        return None if self.position is not None else layout.reason(self.status)


class Skeleton:
    """One person in a frame. `message` is a copy of the struct `SkeletonMessage`."""

    def __init__(self, message, running):
        self.message, self._running = message, running

    @property
    def id(self):
        """Identity within the run, counted from 1."""
        return int(self.message["id"])

    @property
    def status(self):
        """"ok", or the reason for a missing skeleton."""
        return layout.reason(self.message["status"])

    @property
    def positions(self):
        """Positions of all joints, `[joint, axis]` in metres; NaN for a missing joint."""
        joints = self.message["joints"][: int(self.message["n_joints"])]
        found = joints["status"] == layout.OK
        return np.where(found[:, None], joints["in_world"], np.nan)

    @property
    def sides(self):
        """Certainty of left and right: "sure", "unsure" or "as seen"."""
        number = int(self.message["sides"])
        return layout.SIDES[number] if number < len(layout.SIDES) else "unknown"

    def joint(self, name):
        """Returns the joint with a name. A missing joint has no position, but a reason."""
        try:
            number = self._running["joints"].index(name)
        except ValueError:
            raise KeyError(f"there is no joint {name!r}; the joints are {', '.join(self._running['joints'])}") from None
        if number >= int(self.message["n_joints"]):
            return Joint(name, None, None, None, None, 0, int(self.message["status"]))
        return _joint(name, self.message["joints"][number])

    def joints(self):
        """Returns all joints by name."""
        return {name: self.joint(name) for name in self._running["joints"]}


def _joint(name, joint):
    if joint["status"] != layout.OK:
        return Joint(name, None, None, None, None, 0, int(joint["status"]))
    xx, xy, xz, yy, yz, zz = (float(it) for it in joint["covariance"])
    covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    deviation = float(np.sqrt(max(0.0, (xx + yy + zz) / 3)))
    n_views = bin(int(joint["views_used"])).count("1")
    position = np.array(joint["in_world"])
    return Joint(name, position, covariance, deviation, float(joint["reprojection_px"]), n_views, layout.OK)


class Picture:
    """A picture of one view. `pixels` is `[row, column, RGB]`, or None if there are no pixels; `status` has the reason."""

    def __init__(self, header, pixels, sample=None):
        self.header, self._sample = header, sample
        status = int(header["status"])
        self.status, self.pixels = layout.reason(status), None
        self.frame = int(header["stamp"]["frame"])
        height, width = int(header["height"]), int(header["width"])
        if status == layout.OK:
            self.pixels = pixels.reshape(height, width, 3)

    def release(self):
        """Returns the memory to the sender, if the picture is not a copy."""
        sample, self._sample = self._sample, None
        if sample is not None:
            self.header = self.pixels = None
            sample.release()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.release()


class Moment:
    """All requested messages of one frame that have arrived.

    `skeletons` is a copy of the message `Skeletons`. `people` has a `Skeleton` for each person; the followed person comes first.
    `poses` and `pictures` are dictionaries by camera. `n_missed` is the number of frames between this moment and the previous one.
    """

    def __init__(self, session, frame):
        self.session, self.frame, self.captured_at_nanos = session, frame, None
        self.skeletons, self.people, self.poses, self.pictures = None, [], {}, {}
        self.n_missed, self.is_complete = 0, False
        self._since = time.monotonic()

    @property
    def status(self):
        """"ok" if there is a skeleton, otherwise the reason for its absence; None if skeletons were not requested."""
        return None if self.skeletons is None else layout.reason(self.skeletons["status"])

    @property
    def followed(self):
        """The followed person; None if there is no person."""
        return self.people[0] if self.people else None

    def person(self, identity):
        """Returns the person with an identity; None if this person is not in the frame."""
        return next((it for it in self.people if it.id == identity), None)

    def _set(self, skeletons, running):
        self.skeletons = skeletons
        self.people = [Skeleton(it, running) for it in skeletons["people"][: int(skeletons["n_people"])]]


def connect(name, *, skeletons=True, poses=False, pictures=False, cameras=None, every=False, most=256, wait=False):
    """Connects to a running deployment.

    skeletons, poses, pictures: the messages to receive for every frame. Pictures in moments are copies; `Client.picture`
    returns one in the sender's memory.
    cameras: names of the cameras; None for all.
    every: true to receive every frame in order, with at most `most` of them waiting; false to receive the newest frame.
    wait: true to wait for the deployment if it is not running; false to raise an error.
    """
    return Client(name, skeletons, poses, pictures, cameras, most if every else 1, wait)


class Client:
    """Reads a deployment; see `connect`.

    It disconnects when the deployment ends, and automatically connects to the next run with the same name.
    """

    def __init__(self, name, skeletons, poses, pictures, cameras, most, wait):
        if not (skeletons or poses or pictures):
            raise ClientError("no data are requested: choose skeletons, poses or pictures")
        self.name, self._wish = name, (skeletons, poses, pictures)
        self._cameras, self._most = cameras, most
        self._changed, self._ready = threading.Condition(), collections.deque()
        self._problem, self._leaving, self._last = None, False, None
        self.running, self.refused, self.passed_over = None, 0, 0
        self._run = None
        try:
            self._run = self._join()
        except NotRunning:
            if not wait:
                raise
        self._thread = threading.Thread(target=self._read, name="parallax-client", daemon=True)
        self._thread.start()

    @property
    def is_connected(self):
        """True while the deployment is running and is being read."""
        return self._run is not None

    def next(self, patience=None):
        """Returns the next moment; None if there is none within `patience` seconds. Without `patience`, waits forever."""
        with self._changed:
            self._changed.wait_for(lambda: self._ready or self._problem or self._leaving, patience)
            if not self._ready:
                problem, self._problem = self._problem, None
                if problem is not None:
                    raise problem
                return None
            moment = self._ready.popleft()
        step = max(1, int(self.running.get("frame_step", 1)))
        if self._last is not None and self._last[0] == moment.session:
            moment.n_missed = max(0, (moment.frame - self._last[1]) // step - 1)
        self._last = (moment.session, moment.frame)
        return moment

    def moments(self, patience=None):
        """Yields moments until there is none within `patience` seconds."""
        while (moment := self.next(patience)) is not None:
            yield moment

    def picture(self, camera, patience=1.0):
        """Returns the newest picture of a camera in the sender's memory, for use in a `with` statement.

        Returns None if there is no picture in time. Do not hold the picture for long: only one picture of each camera can be
        held at a time.
        """
        port = self._in_place("frame", camera)
        return self._newest(port, lambda it: Picture(it.message, it.array, it), patience)

    def latest_skeletons(self, patience=1.0):
        """Returns the newest message `Skeletons` in the sender's memory as a `Sample`, for use in a `with` statement.

        Returns None if there is no message in time.
        """
        return self._newest(self._in_place("skeletons", None), lambda it: it, patience)

    def _in_place(self, about, camera):
        run = self._run
        if run is None:
            raise NotRunning(self.name, running_deployments())
        key = (about, camera)
        if key not in run.in_place:
            whose = None if camera is None else _number(run.guest, camera)
            run.in_place[key] = run.guest.port(about, whose)
        return run.in_place[key]

    def _newest(self, port, made, patience):
        end, newest = time.monotonic() + patience, None
        while True:
            while True:
                try:
                    sample = port.receive()
                except TooManyHeld:
                    if newest is None:
                        raise
                    # A newer message has arrived: release the previous one.
                    newest.release()
                    newest = None
                    continue
                if sample is None:
                    break
                if newest is not None:
                    newest.release()
                newest = sample if _is_ours(sample, self._run) else None
            if newest is not None:
                return made(newest)
            if time.monotonic() > end:
                return None
            time.sleep(_PAUSE_S)

    def close(self):
        """Disconnects from the deployment."""
        with self._changed:
            self._leaving = True
            self._changed.notify_all()
        self._thread.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _join(self):
        guest = Guest(self.name)
        try:
            run = _Run(guest, self._wish, self._cameras)
        except BaseException:
            guest.close()
            raise
        self.running = guest.running
        return run

    def _read(self):
        while not self._leaving:
            if self._run is None:
                try:
                    self._run = self._join()
                except NotRunning:
                    time.sleep(_RETRY_S)
                    continue
                except ClientError as error:
                    self._tell(error)
                    time.sleep(_RETRY_S)
                    continue
            try:
                self._read_run(self._run)
            except ClientError as error:
                self._tell(error)
            finally:
                run, self._run = self._run, None
                run.close()

    def _read_run(self, run):
        checked = time.monotonic()
        while not self._leaving:
            refused = run.refused
            given = run.turn()
            self.refused += run.refused - refused
            if given:
                with self._changed:
                    for moment in given:
                        while len(self._ready) >= self._most:
                            self._ready.popleft()
                            self.passed_over += 1
                        self._ready.append(moment)
                    self._changed.notify_all()
            if time.monotonic() - checked > _CHECK_S:
                checked = time.monotonic()
                if run.guest.is_over():
                    return
            time.sleep(_PAUSE_S)

    def _tell(self, error):
        with self._changed:
            self._problem = error
            self._changed.notify_all()


def _number(guest, camera):
    names = [it["name"] for it in guest.running["views"]]
    if camera not in names:
        raise ClientError(f"deployment {guest.name!r} has no camera {camera!r}; its cameras are {', '.join(names)}")
    return names.index(camera)


def _is_ours(sample, run):
    """Returns true if a message is from this run and its counts and numbers are valid; false for messages that end the run."""
    message = sample.message
    if run is None or int(message["stamp"]["session"]) != run.guest.running["session"]:
        return False
    if int(message["status"]) == layout.END:
        return False
    if sample.array is not None:
        n = int(message["width"]) * int(message["height"]) * 3
        return int(message["status"]) != layout.OK or (n > 0 and n == len(sample.array))
    if "n_people" in message.dtype.names:
        return _are_skeletons(message, run.guest.running)
    return int(message["n_candidates"]) <= layout.LIMITS["MAX_CANDIDATES"]


def _are_skeletons(message, running):
    n_people = int(message["n_people"])
    if n_people > layout.LIMITS["MAX_PEOPLE"]:
        return False
    people = message["people"][:n_people]
    return len(set(people["id"].tolist())) == n_people and all(_is_skeleton(it, running) for it in people)


def _is_skeleton(person, running):
    n_joints, n_views = int(person["n_joints"]), int(person["n_views"])
    if n_joints != len(running["joints"]) or n_views != len(running["views"]):
        return False
    joints = person["joints"][:n_joints]
    found = joints[joints["status"] == layout.OK]
    return bool(np.isfinite(found["in_world"]).all() and np.isfinite(found["covariance"]).all())


class _Run:
    """Ports of one run of the deployment, and frames that wait for further messages."""

    def __init__(self, guest, wish, cameras):
        self.guest, self._wish, self.in_place, self.refused = guest, wish, {}, 0
        skeletons, poses, pictures = wish
        names = [it["name"] for it in guest.running["views"]] if cameras is None else list(cameras)
        views = {name: _number(guest, name) for name in names} if poses or pictures else {}
        self._skeletons = guest.port("skeletons") if skeletons else None
        self._poses = {name: guest.port("sightings", view) for name, view in views.items()} if poses else {}
        self._pictures = {name: guest.port("frame", view) for name, view in views.items()} if pictures else {}
        self._pending, self._next = {}, 0

    def close(self):
        self.in_place.clear()
        self.guest.close()

    def turn(self):
        """Returns the complete moments, in order. The skeletons are the last message about a frame."""
        skeletons = list(self._drain(self._skeletons))
        for name, port in self._poses.items():
            for message, _ in self._drain(port):
                self._put(message, lambda it, message=message, name=name: it.poses.__setitem__(name, message))
        for name, port in self._pictures.items():
            for message, pixels in self._drain(port):
                picture = Picture(message, pixels)
                self._put(message, lambda it, picture=picture, name=name: it.pictures.__setitem__(name, picture))
        for message, _ in skeletons:
            self._put(message, lambda it, message=message: it._set(message, self.guest.running))
        return self._take()

    def _drain(self, port):
        """Yields copies of the waiting messages."""
        for _ in range(64):
            sample = port.receive() if port is not None else None
            if sample is None:
                return
            try:
                if _is_ours(sample, self):
                    array = None if sample.array is None else sample.array.copy()
                    yield sample.message.copy(), array
                elif int(sample.message["status"]) != layout.END:
                    self.refused += 1
            finally:
                sample.release()

    def _put(self, message, add):
        stamp = message["stamp"]
        frame = int(stamp["frame"])
        if frame < self._next:
            return
        if len(self._pending) >= _MOST_PENDING and frame not in self._pending:
            del self._pending[min(self._pending)]
        moment = self._pending.setdefault(frame, Moment(self.guest.running["session"], frame))
        captured = int(stamp["captured_at_nanos"])
        moment.captured_at_nanos = min(captured, moment.captured_at_nanos or captured)
        add(moment)

    def _take(self):
        over = [frame for frame, it in self._pending.items() if self._is_over(it)]
        if not over:
            return []
        self._next = max(over) + 1
        given = []
        for frame in sorted(it for it in self._pending if it < self._next):
            moment = self._pending.pop(frame)
            moment.is_complete = self._has_views(moment)
            if moment.skeletons is not None or not self._wish[0]:
                given.append(moment)
        return given

    def _is_over(self, moment):
        if self._wish[0]:
            return moment.skeletons is not None
        return self._has_views(moment) or time.monotonic() - moment._since > 0.5

    def _has_views(self, moment):
        return len(moment.poses) == len(self._poses) and len(moment.pictures) == len(self._pictures)
