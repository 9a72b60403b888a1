"""Will it be read from there?   size, current, distance, lens, light -> pixels, contrast, events, accuracy

`edge_odds` runs the light path and the pixels of `camera` and gives the probability with which each
pixel fires at an edge of the LED. The rest is counting:

1. Region: the boxes that may be found, each with its probability; see `region_odds`.
2. Edge: seen where a bin of delta_t_ID holds more firing pixels than the gate, `led_gate` of a usual
   bin's. Pixels fire each by itself, so their number is Poisson-binomial.
3. Packet: a missed edge leaves a bit without its switch, so all must be seen: n rises, n falls and
   the fall ahead of the start. q = P_on^n P_off^(n + 1), averaged over the payloads.
4. Period: delta_t_whole holds k whole packets, or k - 1, by its phase (33 ms: two or one). One that
   is read suffices: 1 - (1 - q)^k.

Edges are taken as independent, given the pixels' thresholds and the marker's place within a pixel.
Those stay for a whole recording, so the average over draws of them comes last. Left out: clutter, the
readout, motion, and errors that a checksum lets pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Scene, Still
from bicode_lab.camera.plate_image import image_corners
from bicode_lab.marker import Board, Marker, PacketFormat, encode_packet
from bicode_lab.marker.marker import Band
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.link_budget.edge_probability import EdgeOdds, edge_odds
from bicode_studies.link_budget.region_probability import RegionOdds

Floats = npt.NDArray[np.float64]

MOST_PAYLOADS = 256  # so many, spread evenly, stand for all of a wider ID


@dataclass(frozen=True, kw_only=True)
class LinkBudget:
    """What reaches the sensor from one marker, and what the receiver makes of it.

    Parameters
    ----------
    side_px : float
        Side of the plate, if it faced the camera [px].
    area_px : float
        Area of the plate's image, its lit edge faces included [px].
    light : float
        current x (projected area / face area) / distance^2, relative to 10.7 mA facing at 1 m: what a
        far marker's contrast goes with (luminance is current / area, and far away area is all that counts).
    contrast : float
        Highest log of lit over dark signal of any pixel.
    events_on, events_off : float
        Mean events of one ON and of one OFF edge, all pixels together.
    edge_on, edge_off : float
        Probability that such an edge is seen, 0 .. 1, mean over draws of thresholds and place.
    packet : float
        Probability that a whole packet is read, 0 .. 1.
    accuracy : float
        Expected share of periods with the right ID, 0 .. 1.
    """

    side_px: float
    area_px: float
    light: float
    contrast: float
    events_on: float
    events_off: float
    edge_on: float
    edge_off: float
    packet: float
    accuracy: float


def link_budget(
    *,
    size_m: float = 0.05,
    current_ma: float = 10.7,
    distance_m: float = 20.0,
    optics: Optics | None = None,
    illuminance_lux: float = 350.0,
    band: Band = "visible",
    yaw_deg: float = 0.0,
    receiver: ReceiverSettings | None = None,
    seed: int = 0,
) -> LinkBudget:
    """A marker, where it is, a lens and the light in; the link's budget out. The defaults are the paper's.

    Parameters
    ----------
    size_m, current_ma : float
        Side of the plate [m] and LED current [mA].
    distance_m, yaw_deg : float
        Along the optical axis [m], and out of plane [deg].
    optics : Optics, optional
        Sensor, lens and filter; None takes the paper's.
    illuminance_lux : float
        Of the surroundings.
    band : {"visible", "infrared"}
    receiver : ReceiverSettings, optional
        None takes the paper's; its packet format is what the marker sends.
    seed : int
        For the pixels' thresholds.

    Examples
    --------
    >>> near, far = link_budget(distance_m=2.5), link_budget(distance_m=60)
    >>> round(near.side_px, 1), round(near.accuracy, 2), round(far.accuracy, 2)
    (32.9, 1.0, 0.0)
    """
    receiver = receiver or ReceiverSettings()
    board = Board(size_m=size_m)
    marker = Marker(board=board, current_ma=current_ma, band=band, packet_format=receiver.packet_format, payload=1)
    placed = PlacedMarker(marker=marker, path=Still(Pose.facing(distance_m, yaw_deg=yaw_deg)))
    scene = Scene(markers=(placed,), optics=optics or Optics(), light=Light(illuminance_lux=illuminance_lux))
    return budget_of(scene, receiver, seed=seed)


def budget_of(scene: Scene, receiver: ReceiverSettings | None = None, *, seed: int = 0) -> LinkBudget:
    """Any scene in, the budget of its first marker as it is at the start, and of that receiver, out."""
    receiver = receiver or ReceiverSettings(packet_format=scene.markers[0].marker.packet_format)
    marker, pose = scene.markers[0].marker, scene.marker_pose(0, 0.0)
    odds = edge_odds(scene, receiver.delta_t_id_us, seed)
    seen = edges_seen(odds, marker, receiver)
    weights, off, on = np.array([case for draw in seen for case in draw]).T
    weights /= len(seen)
    rises = rises_of(marker.packet_format)
    packet = on[:, None] ** rises * off[:, None] ** (rises + 1)
    many, few = whole_packets(receiver.delta_t_whole_us / marker.packet_format.packet_us)
    right = sum(share * (1 - (1 - packet) ** k) for k, share in (many, few))
    distance_m = float(np.linalg.norm(pose.position_m))
    side_px = marker.board.size_m * scene.optics.focal_px / distance_m
    area_px = image_area_px(marker.board, pose, scene.optics)
    return LinkBudget(
        side_px=side_px,
        area_px=area_px,
        light=marker.current_ma / 10.7 * area_px / side_px**2 / distance_m**2,
        contrast=odds.contrast,
        events_on=odds.events[1],
        events_off=odds.events[0],
        edge_on=float(weights @ on),
        edge_off=float(weights @ off),
        packet=float(weights @ packet.mean(1)),
        accuracy=min(1.0, float(weights @ np.mean(right, axis=1))),
    )


def image_area_px(board: Board, pose: Pose, optics: Optics) -> float:
    """A posed plate in, the area of its image out, the edge faces in sight included [px]."""
    return float(cv2.contourArea(cv2.convexHull(image_corners(board, pose, optics).astype(np.float32))))


def edges_seen(odds: EdgeOdds, marker: Marker, receiver: ReceiverSettings) -> list[list[tuple[float, float, float]]]:
    """Pixels' odds in; for each draw the boxes that may be found out: how probably, and that OFF and ON are seen."""
    regions = RegionOdds(marker, receiver)
    seen = []
    for of_bins, of_chip in zip(odds.odds, odds.fires, strict=True):
        cases = []
        for weight, box in regions(of_chip):
            inside = of_bins[:, :, *box] if box else np.zeros((2, 1, 0, 0))
            off, on = (edge_seen(side.reshape(side.shape[0], -1), receiver.led_gate) for side in inside)
            cases.append((weight, off, on))
        seen.append(cases)
    return seen


def edge_seen(odds: Floats, led_gate: float) -> float:
    """Odds of each bin and pixel, shape (bins, n), in; probability that some bin holds more than the gate out.

    The gate is `led_gate` of a usual bin's count, E[N^2] / E[N] over the bins, as in `recognition.led_state`.

    Examples
    --------
    >>> edge_seen(np.array([[0.5, 0.5]]), led_gate=0.0)
    0.75
    """
    mean = odds.sum(1)
    if not mean.sum() > 0:
        return 0.0
    gate = led_gate * float((mean**2 + (odds * (1 - odds)).sum(1)).sum() / mean.sum())
    missed = [at_most(row, int(np.floor(gate))) for row in odds]
    return float(1 - np.prod(missed))


def at_most(odds: Floats, most: int) -> float:
    """Probabilities of independent things in; that of at most `most` of them happening out (Poisson-binomial).

    Examples
    --------
    >>> round(at_most(np.array([0.5, 0.5, 0.5]), 1), 3)
    0.5
    """
    happens = odds[odds > 0]
    mean = happens.sum()
    if abs(mean - most) > 8 * np.sqrt(mean) + 8:  # beyond eight standard deviations
        return float(mean < most)
    chance = np.zeros(most + 1)
    chance[0] = 1.0
    for p in happens:
        chance[1:] = chance[1:] * (1 - p) + chance[:-1] * p
        chance[0] *= 1 - p
    return float(chance.sum())


@lru_cache
def rises_of(packet_format: PacketFormat) -> npt.NDArray[np.int64]:
    """A format in, how many ON edges a packet has, for every payload (for evenly spread ones of a wide ID), out.

    Examples
    --------
    >>> rises = rises_of(PacketFormat())
    >>> rises.size, int(rises.min()), int(rises.max())
    (256, 6, 11)
    """
    payloads = np.unique(np.linspace(0, 2**packet_format.payload_bits - 1, MOST_PAYLOADS).astype(np.int64))
    return np.array([int((np.diff(encode_packet(int(p), packet_format).astype(int)) > 0).sum()) for p in payloads])


def whole_packets(periods: float) -> tuple[tuple[int, float], tuple[int, float]]:
    """How many packets long a period is in; how many it may hold whole, and with what share of phases, out.

    Examples
    --------
    >>> (two, often), (one, oftener) = whole_packets(33 / 14)
    >>> two, round(often, 2), one, round(oftener, 2)
    (2, 0.36, 1, 0.64)
    """
    whole = int(np.floor(periods))
    return (whole, periods - whole), (max(whole - 1, 0), 1 - (periods - whole))
