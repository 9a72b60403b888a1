"""Results of a receiver for one track in one period, and tables of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bicode_lab.recognition.decode import Packet, Reason

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("t_us", "track", "x", "y", "w", "h", "id", "reason", "n_packets", "marker_2d_id", "rvec", "tvec")


@dataclass(frozen=True, kw_only=True)
class Sighting:
    """What a receiver says of one track in one period.

    Parameters
    ----------
    t_us : int
        Start of the period, in the time of the recording [us].
    track : int
        Number of the track.
    x, y, w, h : int
        Column and row of the top left pixel of the box, and its size [px].
    id : int or None
        Payload of the packets that lie whole inside the period and whose checksum holds; None if there is no such
        packet, or if two of them differ.
    reason : str or None
        Why there is no ID, one of `decode.REASONS`; None if there is one.
    n_packets : int
        Number of packets that lie whole inside the period and whose checksum holds.
    packets : tuple of Packet
        All packets that lie whole inside the period and could be read as bits.
    border_packets : tuple of Packet
        Packets that began in the period before and ended in this one; they do not count for the ID.
    marker_2d_id : int or None
        Number of the 2D marker that was recognised in the box.
    corners : tuple of 4 pairs, or None
        Corners x, y of its pattern [px].
    rvec, tvec : tuple of 3 floats, or None
        Its pose in camera axes: rotation vector [rad] and position [m].
    """

    t_us: int
    track: int
    x: int
    y: int
    w: int
    h: int
    id: int | None = None
    reason: Reason | None = None
    n_packets: int = 0
    packets: tuple[Packet, ...] = ()
    border_packets: tuple[Packet, ...] = ()
    marker_2d_id: int | None = None
    corners: tuple[tuple[float, float], ...] | None = None
    rvec: tuple[float, float, float] | None = None
    tvec: tuple[float, float, float] | None = None

    def row(self) -> dict[str, Any]:
        """Return the row of the table of sightings, by the names of its columns."""
        return {name: getattr(self, name) for name in COLUMNS}


@dataclass(frozen=True)
class PacketRow:
    """One packet of a track.

    Parameters
    ----------
    t_us : int
        Start of the packet, in the time of the recording [us].
    track : int
        Number of the track.
    id : int or None
        Payload.
    checksum_ok : bool
        Whether the checksum holds.
    """

    t_us: int
    track: int
    id: int | None
    checksum_ok: bool


def packet_rows(sightings: Iterable[Sighting]) -> Iterator[PacketRow]:
    """List the packets of sightings, each once; packets across the border of a period are included.

    Parameters
    ----------
    sightings : iterable of Sighting
        In the order of time.

    Yields
    ------
    PacketRow
        One for each packet that could be read as bits.
    """
    for sighting in sightings:
        for packet in (*sighting.border_packets, *sighting.packets):
            yield PacketRow(packet.start_us, sighting.track, packet.payload, packet.checksum_ok)


def to_table(sightings: Iterable[Sighting]) -> pd.DataFrame:
    """Make a table of sightings.

    Parameters
    ----------
    sightings : iterable of Sighting

    Returns
    -------
    DataFrame
        One row for each sighting, with the columns `COLUMNS`. Whole numbers that may be missing are of type Int64.

    Examples
    --------
    >>> to_table([Sighting(t_us=0, track=1, x=5, y=6, w=7, h=8, id=37, n_packets=1)])[["t_us", "track", "id", "reason"]]
       t_us  track  id reason
    0     0      1  37   None
    """
    import pandas as pd  # here, as it takes half a second, which a decoder without tables should not wait for

    rows = list(sightings)
    table = pd.DataFrame([sighting.row() for sighting in rows], columns=list(COLUMNS))
    whole = ("t_us", "track", "x", "y", "w", "h", "n_packets")
    types = {**dict.fromkeys(whole, "int64"), "id": "Int64", "marker_2d_id": "Int64"}
    return table.astype(types).assign(reason=pd.Series([s.reason for s in rows], dtype=object))
