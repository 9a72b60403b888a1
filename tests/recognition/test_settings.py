"""Settings that the receiver refuses, and the messages."""

import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import ReceiverSettings, settings_for


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"delta_t_id_us": 600},
            r"delta_t_id_us=600 is longer than one chip \(500 us at f_id_hz=1000\); choose 500 or",
        ),
        ({"delta_t_id_us": 0}, "delta_t_id_us=0 is not a whole number of microseconds"),
        ({"delta_t_2d_us": 40_000}, "delta_t_2d_us=40000 is longer than delta_t_whole_us=33000; choose 33000 or less"),
        ({"delta_t_blinker_us": 33_001}, "delta_t_blinker_us=33001 is longer than delta_t_whole_us"),
        ({"manchester": "biphase"}, "manchester='biphase' is not known"),
        (
            {"manchester": "auto", "packet_format": PacketFormat(payload_bits=7)},
            "'auto' cannot work with payload_bits=7",
        ),
        ({"frame_rule_2d": "mean"}, "frame_rule_2d='mean' is not known"),
        ({"dictionary": "DICT_9X9"}, "dictionary='DICT_9X9' is not one of OpenCV's"),
        ({"led_gate": 1.5}, "led_gate=1.5 is not a share"),
        ({"width": 0}, "width=0 is too small"),
        ({"pattern_size_m": 0}, "pattern_size_m=0 is not a length"),
    ],
)
def test_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ReceiverSettings(**changes)


def test_the_papers_values() -> None:
    s = ReceiverSettings()
    assert (s.delta_t_whole_us, s.delta_t_2d_us, s.delta_t_blinker_us, s.delta_t_id_us) == (33_000, 13_200, 2_000, 250)
    assert settings_for(PacketFormat()) == s
    assert s.principal_point_px == (639.5, 359.5)


def test_conventions() -> None:
    assert ReceiverSettings().conventions == ("ieee",)
    assert ReceiverSettings(packet_format=PacketFormat(manchester="thomas")).conventions == ("thomas",)
    assert ReceiverSettings(manchester="auto").conventions == ("ieee", "thomas")


@pytest.mark.parametrize("f_id_hz", [100.0, 250.0, 333.3, 10_000.0, 100_000.0])
def test_scaled_times_keep_the_rules(f_id_hz: float) -> None:
    s = settings_for(PacketFormat(f_id_hz=f_id_hz), width=10)
    assert s.delta_t_id_us <= 5e5 / f_id_hz
    assert s.width == 10
