"""Open ROS bags through the package rosbags (an optional extra), and read the events of their messages."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicode_lab.events import Events
from bicode_lab.recordings.bags.messages import (
    columns_of_libcaer,
    columns_of_libcaer_cmp,
    columns_of_mono,
    parse_event_array,
    parse_event_packet,
)
from bicode_lab.recordings.decode import Columns, Decoder
from bicode_lab.recordings.formats import Header, RecordingError
from bicode_lab.recordings.raw.blocks import read_words

_ARRAYS = ("dvs_msgs/msg/EventArray", "prophesee_event_msgs/msg/EventArray")
_PACKETS = ("event_camera_msgs/msg/EventPacket", "event_array_msgs/msg/EventArray")
_COLUMNS_OF = {"mono": columns_of_mono, "libcaer": columns_of_libcaer, "libcaer_cmp": columns_of_libcaer_cmp}


@dataclass(frozen=True, kw_only=True)
class Topic:
    """The messages of a bag that are read."""

    name: str
    kind: str
    encoding: str = ""
    """How the bytes of an EventPacket are to be read; empty for an EventArray."""
    others: tuple[str, ...] = ()
    """Other topics with events."""


def read_bag_header(path: Path) -> Header:
    """Return the header of a ROS bag, after looking at its first message with events.

    Parameters
    ----------
    path : Path
        The .bag, .db3 or .mcap file, or the folder of a ROS 2 bag.

    Returns
    -------
    Header
        Its layout is a `Topic`.

    Raises
    ------
    RecordingError
        If rosbags is not installed, the bag is damaged, or holds no messages with events.
    """
    with _opened(path) as (bag, is_cdr):
        topics = sorted({(each.topic, each.msgtype) for each in bag.connections if each.msgtype in _ARRAYS + _PACKETS})
        if not topics:
            kinds = ", ".join(sorted({each.msgtype for each in bag.connections}))[:150] or "nothing"
            raise RecordingError(
                f"{path}: a ROS bag without messages of events (found: {kinds}); give one with dvs_msgs/EventArray or "
                "event_camera_msgs/EventPacket"
            )
        name, kind = topics[0]
        encoding = ""
        for message in _messages(bag, name):
            if kind in _ARRAYS:
                size_px, _ = parse_event_array(message, is_cdr)
            else:
                packet = parse_event_packet(message, is_cdr)
                size_px, encoding = (packet.width, packet.height), packet.encoding
            break
        else:
            raise RecordingError(f"{path}: topic {name} holds no messages; record or copy it again")
    if encoding not in ("", "evt3", *_COLUMNS_OF):
        known = ", ".join(["evt3", *_COLUMNS_OF])
        raise RecordingError(f"{path}: event packets in the encoding {encoding[:40]!r}; give one of {known}")
    topic = Topic(name=name, kind=kind, encoding=encoding, others=tuple(other for other, _ in topics[1:]))
    label = "ROS 2 bag" if is_cdr else "ROS 1 bag"
    return Header(format=label, size_px=size_px if all(size_px) else None, layout=topic)


def read_bag(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of a ROS bag, message by message.

    Parameters
    ----------
    path : Path
        The bag.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        If the bag is damaged.
    """
    topic: Topic = decoder.header.layout
    if topic.others:
        decoder.remark(f"reads the topic {topic.name}; the bag also holds events of {', '.join(topic.others)}")
    with _opened(path) as (bag, is_cdr):
        messages = _messages(bag, topic.name)
        if topic.encoding == "evt3":
            packets = (parse_event_packet(message, is_cdr) for message in messages)
            yield from read_words(decoder, "EVT3", (packet.data for packet in packets))
            return
        for message in messages:
            yield decoder.filter(_columns(message, is_cdr, topic))


def _columns(message: bytes, is_cdr: bool, topic: Topic) -> Columns:
    """Return the columns of the events of a message."""
    if topic.kind in _ARRAYS:
        return parse_event_array(message, is_cdr)[1]
    return _COLUMNS_OF[topic.encoding](parse_event_packet(message, is_cdr))


def _messages(bag: Any, topic: str) -> Iterator[bytes]:
    """Yield the messages of a topic as bytes, in the order of the bag."""
    connections = [each for each in bag.connections if each.topic == topic]
    for _, _, message in bag.messages(connections):
        yield bytes(message)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, bool]]:
    """Open a bag; give it and whether its messages are those of ROS 2."""
    try:
        from rosbags import rosbag1, rosbag2
    except ImportError:
        raise RecordingError(
            f"{path}: a ROS bag, for which the package rosbags is needed; pip install rosbags"
        ) from None
    is_ros1 = path.is_file() and _begins_as_ros1(path)
    try:
        with (rosbag1.Reader if is_ros1 else rosbag2.Reader)(path) as bag:
            yield bag, not is_ros1
    except RecordingError:
        raise
    except Exception as error:  # a damaged bag can make rosbags raise almost anything
        words = " ".join(str(error).replace(str(path), "").split())[:100]
        raise RecordingError(
            f"{path}: a ROS {1 if is_ros1 else 2} bag that is damaged, cut short or still being written ({words}); "
            f"copy it again, or run: {'rosbag reindex' if is_ros1 else 'ros2 bag reindex'}"
        ) from None


def _begins_as_ros1(path: Path) -> bool:
    """Return whether a file begins as a bag of ROS 1."""
    with path.open("rb") as file:
        return file.read(8) == b"#ROSBAG "
