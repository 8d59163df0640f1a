"""Topics of a running deployment, as NumPy views of shared memory. This module cannot send messages."""

import threading
import time
import weakref
import warnings

import numpy as np

from . import layout, place
from .errors import ClientError, NotRunning, VersionMismatch

try:
    import iceoryx2
except ImportError:  # not needed to read folders
    iceoryx2 = None


class TooManyHeld(ClientError):
    """A held message must be released before another one can be received."""


class _Owner:
    """Memory of a message. The memory is released when the last reference is gone, so no view can outlive it."""

    def __init__(self, sample, pointer, n_bytes):
        self._sample = sample
        # The second entry of `data` makes it read-only.
        self.__array_interface__ = {
            "version": 3, "typestr": "|u1", "shape": (n_bytes,), "data": (pointer, True),
        }


class Sample:
    """A message in the sender's memory. Use it in a `with` statement, or call `release()`.

    `message` is the message (or the header of an array) as a NumPy structured scalar view. `array` is the array after a
    header, or None. Both are read-only views, not copies: copy the data that you keep. The memory is released when
    the last view is gone.
    """

    def __init__(self, sample, message, elements):
        header = layout.dtype(message)
        if elements is None:
            head = _Owner(sample, sample.payload_ptr, header.itemsize)
            self.array = None
            owners = [head]
        else:
            n = sample.header.number_of_elements
            kind = np.dtype(elements)
            head = _Owner(sample, sample.user_header_ptr, header.itemsize)
            body = _Owner(sample, sample.payload_ptr, n * kind.itemsize)
            self.array = np.asarray(body).view(kind)
            owners = [head, body]
        self.message = np.asarray(head).view(header)[0:1].reshape(())
        self._owners = [weakref.ref(it) for it in owners]

    def release(self):
        """Releases the memory, if no view of it is left."""
        self.message = self.array = None
        if any(it() is not None for it in self._owners):
            warnings.warn(
                "a view of a message is still in use: its memory is released when the view is gone; copy the data that you keep",
                ResourceWarning, stacklevel=2,
            )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.release()


class Port:
    """The receiving end of one topic."""

    def __init__(self, guest, subscriber, message, elements):
        self._guest, self._subscriber = guest, subscriber
        self._message, self._elements = message, elements

    def receive(self):
        """Returns the oldest waiting message as a `Sample`, or None."""
        with self._guest.lock:
            if self._subscriber is None:
                return None
            try:
                sample = self._subscriber.receive()
            except iceoryx2.ReceiveError as error:
                if "ExceedsMaxBorrows" in str(error):
                    raise TooManyHeld(
                        "a held message must be released before another one can be received"
                    ) from None
                raise ClientError(f"cannot receive messages: {error}") from None
        return None if sample is None else Sample(sample, self._message, self._elements)

    def _close(self):
        self._subscriber = None


class Guest:
    """A connection to a running deployment."""

    def __init__(self, name):
        if iceoryx2 is None:
            raise ClientError("live messages need the package iceoryx2: `pip install iceoryx2==0.10.0`")
        self.name, self.lock, self._ports = name, threading.RLock(), []
        folder = place.root(name)
        self._folder, self.supervisor = folder, place.supervisor(folder)
        if self.supervisor is None:
            raise NotRunning(name, place.running_deployments())
        # A deployment that is starting writes its description when all its topics exist.
        end = time.monotonic() + 5
        while not place.is_described(name) and not self.is_over() and time.monotonic() < end:
            time.sleep(0.02)
        self.running = place.description(name)
        self._seat = place.Seat(name)
        try:
            iceoryx2.set_log_level(iceoryx2.LogLevel.Fatal)
            file = iceoryx2.FilePath.new(str(folder / "config" / "iceoryx2.toml"))
            self._config = iceoryx2.config.from_file(file)
            # Only the supervisor cleans up after dead processes.
            self._config.global_cfg.service.cleanup_dead_nodes_on_open = False
            self._config.global_cfg.node.cleanup_dead_nodes_on_creation = False
            self._config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
            builder = iceoryx2.NodeBuilder.new().config(self._config)
            builder = builder.name(iceoryx2.NodeName.new(f"guest-{_pid()}"))
            builder = builder.signal_handling_mode(iceoryx2.SignalHandlingMode.Disabled)
            self._node = builder.create(iceoryx2.ServiceType.Ipc)
        except Exception as error:
            self._seat.leave()
            if self.is_over():
                raise NotRunning(name, place.running_deployments()) from None
            raise ClientError(f"cannot read deployment {name!r}: {error}") from error

    def is_over(self):
        """Returns true if the deployment is ending, so that this connection must be closed."""
        return place.supervisor(self._folder) != self.supervisor

    def port(self, about, whose=None):
        """Subscribes to a topic, for example `port("frame", 0)` or `port("skeletons")`."""
        kind = layout.TOPICS[about]
        topic = kind["name"].replace("{}", str(whose))
        message, elements = kind["message"], kind["elements"]
        builder = self._node.service_builder(iceoryx2.ServiceName.new(topic))
        unit = iceoryx2.Slice[{"|u1": _ctypes().c_uint8, "<f4": _ctypes().c_float}[elements]
                              if elements else layout.ctype(message)]
        builder = builder.publish_subscribe(unit)
        if elements is not None:
            details = iceoryx2.TypeDetail.new().type_variant(iceoryx2.TypeVariant.FixedSize)
            struct = layout.ctype(message)
            details = details.type_name(iceoryx2.TypeName.new(struct.type_name()))
            details = details.size(_ctypes().sizeof(struct)).alignment(layout.alignment(message))
            # The public method uses the alignment of a ctypes struct. Before Python 3.13, this is the alignment of a number.
            builder = getattr(builder, "__user_header_type_details")(details)
        try:
            service = builder.open()
            factory = service.subscriber_builder().name(iceoryx2.PortName.new("onlooker"))
            subscriber = factory.create()
        except iceoryx2.PublishSubscribeOpenError as error:
            raise self._why(error, about, topic, kind["version"]) from None
        except iceoryx2.SubscriberCreateError as error:
            raise ClientError(f"cannot read topic {topic!r} of deployment {self.name!r}: {error}") from None
        made = Port(self, subscriber, message, elements)
        self._ports.append(made)
        return made

    def _why(self, error, about, topic, ours):
        if self.is_over():
            return NotRunning(self.name, place.running_deployments())
        if "DoesNotExist" in str(error):
            for other in self.topics():
                begin, _, rest = other.partition("/v")
                if begin == about and rest.split("/")[0] != str(ours):
                    return VersionMismatch(self.name, about, rest.split("/")[0], ours)
            return ClientError(f"deployment {self.name!r} has no topic {topic!r}")
        if "IncompatibleTypes" in str(error):
            return ClientError(
                f"topic {topic!r} of deployment {self.name!r} has a layout that this package does not know: "
                "install the package from the same version of Parallax"
            )
        return ClientError(f"cannot read topic {topic!r} of deployment {self.name!r}: {error}")

    def topics(self):
        """Returns the names of all topics in the deployment."""
        listed = iceoryx2.Service.list(self._config, iceoryx2.ServiceType.Ipc)
        return [str(it.static_details.name).strip('"') if hasattr(it, "static_details") else str(it) for it in listed]

    def close(self):
        """Disconnects from the deployment. While views are still held, the deployment cannot be restarted."""
        with self.lock:
            for it in self._ports:
                it._close()
            self._ports.clear()
            self._node = None
        self._seat.leave()


def _pid():
    import os

    return os.getpid()


def _ctypes():
    import ctypes

    return ctypes
