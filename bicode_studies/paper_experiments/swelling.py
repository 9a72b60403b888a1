"""Why a bright pattern looks larger than it is: where the edge of a lit cell appears behind a blurred lens (IV-A).

A log pixel responds as soon as the LED changes its light by the threshold, however little that is compared with the
light of a pixel on the cell. At x pixels beyond the edge of a lit face that is much wider than the blur, the share
1/2 erfc(x / (sqrt(2) sigma)) of the face's light is left, which makes the contrast

    c(x) = ln(1 + L [(1 - h) 1/2 erfc(x / (sqrt(2) sigma)) + h 1/2 erfc(x / (sqrt(2) sigma_h))])

where L is the light of the face over the ambient light, h the share of the halo, and sigma and sigma_h the blur and the
width of the halo. The pattern seems to end where c equals the threshold.
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
    """Return the light of the lit cells of a scene's first marker over that of its dark plate.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    float
        Ratio of the signals of a pixel, L above.

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
    """Return the share of a face's light at distances beyond its edge.

    Parameters
    ----------
    x_px : array_like
        Distance beyond the edge [px]; negative on the face.
    optics : Optics
        Its blur and halo are used.

    Returns
    -------
    ndarray
        Shares, 0 .. 1; shape of `x_px`.
    """
    x = np.asarray(x_px, float)
    core, halo = (0.5 * erfc(x / (np.sqrt(2) * sigma)) for sigma in (optics.blur_px, optics.halo_px))
    return np.asarray((1 - optics.halo_fraction) * core + optics.halo_fraction * halo)


def edge_contrast(x_px: npt.ArrayLike, over_ambient: float, optics: Optics) -> Floats:
    """Return the log contrast between LED on and off at distances beyond the edge of a face, c(x) above.

    Parameters
    ----------
    x_px : array_like
        Distance beyond the edge [px]; negative on the face.
    over_ambient : float
        Light of the face over the ambient light, see `face_over_ambient`.
    optics : Optics

    Returns
    -------
    ndarray
        Contrasts, 0 or more; shape of `x_px`.
    """
    return np.log1p(over_ambient * share_beyond(x_px, optics))


def gap_contrast(width_px: npt.ArrayLike, over_ambient: float, optics: Optics) -> Floats:
    """Return the log contrast in the middle of a dark stripe between two lit faces.

    Where it is above the threshold, the stripe is no longer visible.

    Parameters
    ----------
    width_px : array_like
        Width of the stripe [px].
    over_ambient : float
        Light of the faces over the ambient light, see `face_over_ambient`.
    optics : Optics

    Returns
    -------
    ndarray
        Contrasts, 0 or more; shape of `width_px`.

    Examples
    --------
    >>> closed, open_ = gap_contrast([2, 8], 1.0, Optics(blur_px=1.0, halo_fraction=0.0)) > 0.25
    >>> bool(closed), bool(open_)
    (True, False)
    """
    return np.log1p(2 * over_ambient * share_beyond(np.asarray(width_px, float) / 2, optics))


def rim_px(over_ambient: float, threshold: float, optics: Optics) -> float:
    """Return how far beyond its edge a face seems to reach.

    Parameters
    ----------
    over_ambient : float
        Light of the face over the ambient light, see `face_over_ambient`.
    threshold : float
        Log contrast at which a pixel responds.
    optics : Optics

    Returns
    -------
    float
        Distance [px]; negative where the face looks smaller than it is, nan where no part of it reaches the threshold.
    """
    far = 6 * max(optics.blur_px, optics.halo_px)

    def above(x_px: float) -> float:
        return float(edge_contrast(x_px, over_ambient, optics)) - threshold

    return float(brentq(above, -far, far)) if above(-far) > 0 else float("nan")
