"""The drawing style, and figures saved together with their data and parameters.

A figure is saved as three files: ``fig_NN_slug.png``, the plotted data as ``.csv``, and the parameters, the seed and
the versions as ``.json``. The same data give the same bytes. The environment variable ``BICODE_FIGURES`` names the
folder; without it, figures go to ``figures/quick`` of the repository.
"""

from __future__ import annotations

import dataclasses
import json
import platform
import re
from collections.abc import Mapping
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bicode_studies.repository import figures_folder

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

FIGURE_DPI = 150
SLUG = re.compile(r"\d\d_[a-z0-9]+(_[a-z0-9]+)*")
RECORDED_VERSIONS = ("numpy", "scipy", "pandas", "matplotlib", "opencv-contrib-python-headless", "numba")


def use_style() -> None:
    """Give every figure drawn from now on the look of this collection (``plots/bicode.mplstyle``)."""
    from matplotlib import pyplot as plt

    with resources.as_file(resources.files("bicode_studies") / "plots" / "bicode.mplstyle") as style:
        plt.style.use(style)


def save_figure(
    fig: Figure,
    slug: str,
    data: pd.DataFrame | Mapping[str, Any],
    parameters: Mapping[str, Any],
) -> Path:
    """Save a figure, the data it shows and the parameters it was made with.

    Parameters
    ----------
    fig : matplotlib.figure.Figure
        The figure.
    slug : str
        Figure number and name: ``"02_pipeline"`` becomes ``fig_02_pipeline.png``, ``.csv``, ``.json``.
    data : DataFrame or mapping
        The plotted data, see `as_table`. Numbers that are not integers keep six digits, so give times as integers.
    parameters : mapping
        The values the figure was made with, ``seed`` among them. Settings (dataclasses) may be values.

    Returns
    -------
    Path
        The picture. The two other files lie beside it.

    Raises
    ------
    ValueError
        If the slug does not start with two digits, or if JSON cannot hold a parameter.
    """
    if not SLUG.fullmatch(slug):
        raise ValueError(f"slug {slug!r} does not name a figure; write its number and a name, such as '02_pipeline'")
    folder = figures_folder()
    stem = f"fig_{slug}"
    as_table(data).to_csv(folder / f"{stem}.csv", index=False, float_format="%.6g", lineterminator="\n")
    record = {
        "figure": stem,
        "parameters": dict(parameters),
        "seed": parameters.get("seed"),
        "versions": versions(),
    }
    text = json.dumps(record, sort_keys=True, indent=1, default=_as_json, ensure_ascii=False)
    (folder / f"{stem}.json").write_text(text + "\n", encoding="utf-8")
    picture = folder / f"{stem}.png"
    _write_picture(fig, picture)
    return picture


def as_table(data: pd.DataFrame | Mapping[str, Any]) -> pd.DataFrame:
    """Put plotted data of any shape into one table.

    Parameters
    ----------
    data : DataFrame or mapping
        A mapping of columns of one length becomes one table. Anything else (series of several lengths, frames,
        tables) is written one below the other, with the name in the column ``series``. Of a frame (2-D array), only
        the pixels that are not 0 are written.

    Returns
    -------
    DataFrame
        The table.

    Raises
    ------
    ValueError
        If an array has more than two dimensions.

    Examples
    --------
    >>> as_table({"t_us": [0, 500], "led": [1, 0]})
       t_us  led
    0     0    1
    1   500    0
    >>> as_table({"on": [3], "off": [4, 5]})
      series  index  value
    0     on      0      3
    1    off      0      4
    2    off      1      5
    """
    import pandas as pd

    if isinstance(data, pd.DataFrame):
        return data
    columns = {name: value if isinstance(value, pd.DataFrame) else np.asarray(value) for name, value in data.items()}
    lengths = {value.size for value in columns.values() if value.ndim == 1}
    if len(lengths) <= 1 and all(value.ndim < 2 for value in columns.values()):
        rows = max(lengths, default=1)
        return pd.DataFrame({name: np.broadcast_to(value, rows) for name, value in columns.items()})
    parts = [_as_series(value).assign(series=name) for name, value in columns.items()]
    together = pd.concat(parts, ignore_index=True)
    return together[["series", *(name for name in together.columns if name != "series")]]


def _as_series(value: Any) -> pd.DataFrame:
    """Return one series, frame or table as a table of its own."""
    import pandas as pd

    if isinstance(value, pd.DataFrame):
        return value
    if value.ndim == 2:
        y, x = np.nonzero(value)
        return pd.DataFrame({"y": y, "x": x, "value": value[y, x]})
    if value.ndim > 2:
        raise ValueError(
            f"data of {value.ndim} dimensions cannot be written as a table; give a table, series or frames (2-D)"
        )
    return pd.DataFrame({"index": np.arange(value.size), "value": np.atleast_1d(value)})


def versions() -> dict[str, str]:
    """Return the versions that a result may depend on, by name.

    Returns
    -------
    dict of str to str
        The version of Python and of each package, or "not installed".
    """
    found = {"python": ".".join(platform.python_version_tuple()[:2])}
    for name in ("bicode-lab", *RECORDED_VERSIONS):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def _write_picture(fig: Figure, path: Path) -> None:
    """Write a small PNG without dates or program names, so that the same figure gives the same bytes."""
    from PIL import Image

    fig.savefig(path, dpi=FIGURE_DPI, metadata={"Software": None})
    with Image.open(path) as full:
        flat = Image.new("RGB", full.size, "white")
        flat.paste(full, mask=full.getchannel("A") if "A" in full.getbands() else None)
    few = flat.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    few.save(path, optimize=True, dpi=(FIGURE_DPI, FIGURE_DPI))


def _as_json(value: Any) -> Any:
    """Convert what ``json`` itself cannot write: NumPy's numbers and arrays, settings, paths."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    if isinstance(value, Path):
        return value.name
    raise ValueError(f"parameter {value!r} cannot be written as JSON; give numbers, text, lists or settings")
