"""IV-A: why does a bright pattern swell?   light of a face, blur of the lens -> where the rim of a cell is seen

A log pixel answers as soon as the LED changes its light by the threshold, however little that is beside what a
pixel on the cell gets. Behind the edge of a glowing face that is much wider than the blur, at x pixels, the lens
leaves the share 1/2 erfc(x / (sqrt 2 sigma)) of the face's light, and so the contrast

    c(x) = ln(1 + L [(1 - h) 1/2 erfc(x / (sqrt 2 sigma)) + h 1/2 erfc(x / (sqrt 2 sigma_h))])

where L is the face's light over the ambient, and h the halo's share. The pattern seems to end where c is the threshold.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.special import erfc

from bicode_lab.camera import Optics, Scene
from bicode_lab.camera.optics import ambient_signal, led_signal

Floats = npt.NDArray[np.float64]


def face_over_ambient(scene: Scene) -> float:
    """A scene in, the light of its first marker's glowing cells over that of the dark plate out.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from bicode_lab import Marker, PlacedMarker
    >>> one, two = (Scene(markers=(PlacedMarker(marker=Marker(current_ma=ma)),)) for ma in (10, 20))
    >>> round(face_over_ambient(two) / face_over_ambient(one), 3)
    2.0
    """
    marker, light, optics = scene.markers[0].marker, scene.light, scene.optics
    face = led_signal(marker.luminance_ratio, marker.band, light, optics)
    return face / (ambient_signal(light, optics) * light.plate_reflectance)


def share_beyond(x_px: npt.ArrayLike, optics: Optics) -> Floats:
    """Distances beyond a face's edge [px] (below 0: on it) and a lens in, the share of its light there out, 0 .. 1."""
    x = np.asarray(x_px, float)
    core, halo = (0.5 * erfc(x / (np.sqrt(2) * sigma)) for sigma in (optics.blur_px, optics.halo_px))
    return np.asarray((1 - optics.halo_fraction) * core + optics.halo_fraction * halo)


def edge_contrast(x_px: npt.ArrayLike, over_ambient: float, optics: Optics) -> Floats:
    """Distances beyond a face's edge [px] and the face's light over the ambient in, the log contrast there out."""
    return np.log1p(over_ambient * share_beyond(x_px, optics))


def gap_contrast(width_px: npt.ArrayLike, over_ambient: float, optics: Optics) -> Floats:
    """Widths of a dark stripe between two glowing faces [px] in, the log contrast in its middle out.

    Where it is above the threshold, the stripe has closed.

    Examples
    --------
    >>> closed, open_ = gap_contrast([2, 8], 1.0, Optics(blur_px=1.0, halo_fraction=0.0)) > 0.25
    >>> bool(closed), bool(open_)
    (True, False)
    """
    return np.log1p(2 * over_ambient * share_beyond(np.asarray(width_px, float) / 2, optics))


def rim_px(over_ambient: float, threshold: float, optics: Optics) -> float:
    """A face's light over the ambient, a threshold and a lens in; how far beyond its edge it seems to end out [px].

    Below 0 it seems smaller than it is. nan where it does not reach the threshold anywhere.
    """
    far = 6 * max(optics.blur_px, optics.halo_px)

    def above(x_px: float) -> float:
        return float(edge_contrast(x_px, over_ambient, optics)) - threshold

    return float(brentq(above, -far, far)) if above(-far) > 0 else float("nan")
