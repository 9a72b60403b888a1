"""Bad settings and unusual streams."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import make_events, no_events
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.sequential import SequentialSettings

from .light import HEIGHT, PERIOD_US, WIDTH, receive, settings_of


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"evidence_periods": 0}, "evidence_periods=0 is too small; choose 1 or more"),
        ({"region_periods": -1}, "region_periods=-1 is too small; choose 0 or more"),
        (
            {"receiver": ReceiverSettings(packet_format=PacketFormat(f_id_hz=65_000), delta_t_id_us=1)},
            "f_id_hz=65000 makes a chip shorter than 8 us",
        ),
    ],
)
def test_bad_settings_are_refused_in_one_line(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        SequentialSettings(**changes)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    assert "choose" in str(caught.value)


def test_the_least_settings_are_allowed() -> None:
    fastest = ReceiverSettings(packet_format=PacketFormat(f_id_hz=62_500), delta_t_id_us=1)
    settings = SequentialSettings(receiver=fastest, evidence_periods=1, region_periods=0)
    assert settings.delta_t_whole_us == 33_000


@pytest.mark.parametrize("n", [0, 1, 2])
def test_almost_nothing_is_nothing(n: int) -> None:
    receiver = settings_of().start(0)
    event = make_events([3] * n, [3] * n, [1] * n, [70_000] * n) if n else no_events()
    assert receiver(0, no_events()) == []
    assert receiver(2 * PERIOD_US, event) == []
    assert receiver(3 * PERIOD_US, no_events()) == []
    assert receiver(10_000 * PERIOD_US, no_events()) == []


@pytest.mark.parametrize(("x", "y"), [(WIDTH, 0), (0, HEIGHT), (65535, 65535)])
def test_events_outside_the_sensor_are_refused(x: int, y: int) -> None:
    with pytest.raises(ValueError, match="sensor") as caught:
        settings_of().start(0)(0, make_events([x], [y], [1], [5]))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("x", "y"), [(0, 0), (WIDTH - 1, HEIGHT - 1)])
def test_events_in_a_corner_are_allowed(x: int, y: int) -> None:
    t = np.arange(0, PERIOD_US, 500)
    assert receive(make_events(np.full(t.size, x), np.full(t.size, y), t // 500 % 2, t), settings_of()) == []
