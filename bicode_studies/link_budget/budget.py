"""Link budget: expected ID accuracy from marker, distance, lens and light.

`edge_probability` runs the light path and the pixels of `camera` and gives the probability with which each pixel fires
at an edge of the LED. The rest is counting:

1. Region: the boxes that may be found, each with its probability, see `region_probability`.
2. Edge: it is detected if a bin of delta_t_ID holds more firing pixels than the gate, `led_gate` times a usual bin's
   count. Pixels fire independently, so their number has a Poisson binomial distribution.
3. Packet: a missed edge leaves a bit without its transition, so all edges must be detected: n rises, n falls and the
   fall before the start. q = P_on^n P_off^(n + 1), averaged over the payloads.
4. Period: delta_t_whole holds k whole packets, or k - 1, depending on its phase (33 ms: two or one). One packet that is
   read suffices: 1 - (1 - q)^k.

Edges are taken as independent, given the pixels' thresholds and the marker's place within a pixel. Those are fixed for
a whole recording, so the average over draws of them comes last. Clutter, the readout, motion, and errors that pass the
checksum are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Scene, Still
from bicode_lab.camera.plate_image import image_corners
from bicode_lab.marker import Board, Marker
from bicode_lab.marker.marker import Band
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.link_budget.edge_probability import EdgeProbability, edge_probability
from bicode_studies.link_budget.packet_counts import count_rises, packets_per_period
from bicode_studies.link_budget.region_probability import RegionProbability

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class LinkBudget:
    """What reaches the sensor from one marker, and what the receiver reads of it.

    Attributes
    ----------
    side_px : float
        Side of the plate, if it faced the camera [px].
    area_px : float
        Area of the plate's image, its lit edge faces included [px].
    light : float
        current x (projected area / face area) / distance^2, relative to 10.7 mA facing the camera at 1 m. The contrast
        of a distant marker is proportional to it (luminance is current / area, and only the area counts there).
    contrast : float
        Highest log of lit over dark signal of any pixel.
    events_on, events_off : float
        Mean events of one ON and of one OFF edge, all pixels together.
    edge_on, edge_off : float
        Probability that such an edge is detected, 0 .. 1, mean over draws of thresholds and place.
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
    """Compute the link budget of a marker that stands on the optical axis; the defaults are the paper's.

    Parameters
    ----------
    size_m : float
        Side of the plate [m].
    current_ma : float
        LED current [mA].
    distance_m : float
        Distance along the optical axis [m].
    optics : Optics, optional
        Sensor, lens and filter; None takes the paper's.
    illuminance_lux : float
        Illuminance of the surroundings [lx].
    band : {"visible", "infrared"}
        Band of the LED.
    yaw_deg : float
        Angle between the plate's normal and the optical axis [deg].
    receiver : ReceiverSettings, optional
        None takes the paper's; its packet format is what the marker sends.
    seed : int
        Seed of the pixels' thresholds and noise.

    Returns
    -------
    LinkBudget

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
    """Compute the link budget of the first marker of a scene, as it stands at the start.

    Parameters
    ----------
    scene : Scene
        Its wall, lamps and readout are left out.
    receiver : ReceiverSettings, optional
        None takes the paper's, with the marker's packet format.
    seed : int
        Seed of the pixels' thresholds and noise.

    Returns
    -------
    LinkBudget

    Raises
    ------
    ValueError
        If the marker is not in view.
    """
    receiver = receiver or ReceiverSettings(packet_format=scene.markers[0].marker.packet_format)
    marker, pose = scene.markers[0].marker, scene.marker_pose(0, 0.0)
    edges = edge_probability(scene, receiver.delta_t_id_us, seed)
    draws = detection_cases(edges, marker, receiver)
    weights, off, on = np.array([case for cases in draws for case in cases]).T
    weights /= len(draws)
    rises = count_rises(marker.packet_format)
    packet = on[:, None] ** rises * off[:, None] ** (rises + 1)
    many, few = packets_per_period(receiver.delta_t_whole_us / marker.packet_format.packet_us)
    right = sum(share * (1 - (1 - packet) ** k) for k, share in (many, few))
    distance_m = float(np.linalg.norm(pose.position_m))
    side_px = marker.board.size_m * scene.optics.focal_px / distance_m
    area_px = image_area_px(marker.board, pose, scene.optics)
    return LinkBudget(
        side_px=side_px,
        area_px=area_px,
        light=marker.current_ma / 10.7 * area_px / side_px**2 / distance_m**2,
        contrast=edges.contrast,
        events_on=edges.events[1],
        events_off=edges.events[0],
        edge_on=float(weights @ on),
        edge_off=float(weights @ off),
        packet=float(weights @ packet.mean(1)),
        accuracy=min(1.0, float(weights @ np.mean(right, axis=1))),
    )


def image_area_px(board: Board, pose: Pose, optics: Optics) -> float:
    """Return the area of a plate's image, the visible edge faces included [px].

    Parameters
    ----------
    board : Board
    pose : Pose
        Pose of the plate in the camera's frame.
    optics : Optics

    Returns
    -------
    float
    """
    return float(cv2.contourArea(cv2.convexHull(image_corners(board, pose, optics).astype(np.float32))))


def detection_cases(
    edges: EdgeProbability, marker: Marker, receiver: ReceiverSettings
) -> list[list[tuple[float, float, float]]]:
    """List the boxes that may be found, and how probably edges are detected in each.

    Parameters
    ----------
    edges : EdgeProbability
    marker : Marker
    receiver : ReceiverSettings

    Returns
    -------
    list of list of (float, float, float)
        For each draw of `edges` and each box: probability of the box, of detecting an OFF edge in it, and of detecting
        an ON edge in it, 0 .. 1.
    """
    regions = RegionProbability(marker, receiver)
    draws = []
    for by_bin, by_edge in zip(edges.by_bin, edges.by_edge, strict=True):
        cases = []
        for weight, box in regions(by_edge):
            inside = by_bin[:, :, *box] if box else np.zeros((2, 1, 0, 0))
            off, on = (edge_detected(side.reshape(side.shape[0], -1), receiver.led_gate) for side in inside)
            cases.append((weight, off, on))
        draws.append(cases)
    return draws


def edge_detected(fires: Floats, led_gate: float) -> float:
    """Return the probability that the count of some bin after an edge exceeds the gate.

    The gate is `led_gate` times a usual bin's count, E[N^2] / E[N] over the bins, as in `recognition.led_state`.

    Parameters
    ----------
    fires : ndarray, shape (bins, n)
        Probability that each of n pixels fires in each bin, 0 .. 1.
    led_gate : float
        Share of a usual count, 0 .. 1.

    Returns
    -------
    float
        0 .. 1.

    Examples
    --------
    >>> edge_detected(np.array([[0.5, 0.5]]), led_gate=0.0)
    0.75
    """
    mean = fires.sum(1)
    if not mean.sum() > 0:
        return 0.0
    gate = led_gate * float((mean**2 + (fires * (1 - fires)).sum(1)).sum() / mean.sum())
    missed = [at_most(row, int(np.floor(gate))) for row in fires]
    return float(1 - np.prod(missed))


def at_most(probabilities: Floats, most: int) -> float:
    """Return the probability that at most `most` of several independent things happen (Poisson binomial).

    Parameters
    ----------
    probabilities : ndarray, shape (n,)
        Probability of each thing, 0 .. 1.
    most : int

    Returns
    -------
    float
        0 .. 1; a count more than eight standard deviations away from the mean is taken as certain or impossible.

    Examples
    --------
    >>> round(at_most(np.array([0.5, 0.5, 0.5]), 1), 3)
    0.5
    """
    possible = probabilities[probabilities > 0]
    mean = possible.sum()
    if abs(mean - most) > 8 * np.sqrt(mean) + 8:
        return float(mean < most)
    of_count = np.zeros(most + 1)  # probability of each count
    of_count[0] = 1.0
    for p in possible:
        of_count[1:] = of_count[1:] * (1 - p) + of_count[:-1] * p
        of_count[0] *= 1 - p
    return float(of_count.sum())
