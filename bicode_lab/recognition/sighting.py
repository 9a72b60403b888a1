"""What the receiver says of one track in one period, and tables of it."""

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
    """One track in one period.

    Parameters
    ----------
    t_us : int
        The period's start [us], the recording's own clock.
    track : int
        Number of the track.
    x, y, w, h : int
        Box, from its top left pixel [px].
    id : int or None
        Payload of the packets whole inside the period whose checksum holds; None where there is none,
        or where two differ.
    reason : str or None
        Why there is no ID, one of `decode.REASONS`; None where there is one.
    n_packets : int
        Packets whole inside the period whose checksum holds.
    packets : tuple of Packet
        All packets whole inside the period that made bits.
    border_packets : tuple of Packet
        Packets that began in the period before and ended in this one; they do not count for the ID.
    marker_2d_id : int or None
        Number of the 2D marker recognised in the box.
    corners : tuple of 4 pairs, or None
        Its corners x, y [px].
    rvec, tvec : tuple of 3 floats, or None
        Its pose, rotation vector [rad] and place [m] in camera axes.
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
        """Nothing in, the row of the sightings' table out."""
        return {name: getattr(self, name) for name in COLUMNS}


@dataclass(frozen=True)
class PacketRow:
    """One packet of a track: first moment of its off time [us], track, what it says, whether its checksum holds."""

    t_us: int
    track: int
    id: int | None
    checksum_ok: bool


def packet_rows(sightings: Iterable[Sighting]) -> Iterator[PacketRow]:
    """Sightings in, one row for each packet that made bits out, those across a period's border too, each once."""
    for sighting in sightings:
        for packet in (*sighting.border_packets, *sighting.packets):
            yield PacketRow(packet.start_us, sighting.track, packet.payload, packet.checksum_ok)


def to_table(sightings: Iterable[Sighting]) -> pd.DataFrame:
    """Sightings in, a table with a row each out; whole numbers that may be missing are of type Int64.

    Examples
    --------
    >>> to_table([Sighting(t_us=0, track=1, x=5, y=6, w=7, h=8, id=37, n_packets=1)])[["t_us", "track", "id", "reason"]]
       t_us  track  id reason
    0     0      1  37   None
    """
    import pandas as pd  # half a second that a decoder without tables need not wait for

    rows = list(sightings)
    table = pd.DataFrame([sighting.row() for sighting in rows], columns=list(COLUMNS))
    whole = ("t_us", "track", "x", "y", "w", "h", "n_packets")
    types = {**dict.fromkeys(whole, "int64"), "id": "Int64", "marker_2d_id": "Int64"}
    return table.astype(types).assign(reason=pd.Series([s.reason for s in rows], dtype=object))
