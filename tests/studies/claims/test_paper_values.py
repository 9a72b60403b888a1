"""Values that the package takes from the paper as they stand; the table of claims calls them "used as stated"."""

import numpy as np
import pytest

from bicode_lab import paper
from bicode_lab.camera import Optics
from bicode_lab.camera.optics import IR88_TRANSMITTANCE
from bicode_lab.marker import Board, Marker, PacketFormat, encode_packet
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.claims.table import read_claims
from bicode_studies.claims.text_claims import FACTS
from bicode_studies.claims.verdicts import judge_claims
from tests.studies.claims.paper_world import paper_world

PACKET, RECEIVER = PacketFormat(), ReceiverSettings()
VALUES = {
    "P01": (PACKET.packet_us, 14_000),
    "P02": (PACKET.payload_bits, 8),
    "P03": (PACKET.f_id_hz, 1000),
    "P05": (PACKET.start_bits * 1e6 / PACKET.f_id_hz, 3000),
    "P06": (PACKET.checksum_bits, 14 - 3 - 8),
    "A3": (PACKET.f_id_hz, 1000),
    "I01": (RECEIVER.delta_t_2d_us, 13_200),
    "I02": (RECEIVER.delta_t_blinker_us, 2000),
    "I03": (RECEIVER.delta_t_id_us, 250),
    "I04": (RECEIVER.delta_t_whole_us, 33_000),
    "I05": (Optics().focal_length_mm, 8),
    "I06": (paper.F_NUMBER_VISIBLE, 5.6),
    "I07": (paper.F_NUMBER_INFRARED, 2.0),
    "I09": (Board().thickness_m, 0.005),
    "I13": (IR88_TRANSMITTANCE, 0.8),
    "I18": (paper.OFFICE_LUX, 350),
    "I19": (paper.EVENING_LUX, 2000),
    "I20": (paper.FIG_10_SIZES_M, (0.025, 0.05, 0.1)),
    "I21": (paper.FIG_8_CURRENTS_MA, (5.5, 10.7, 21.3)),
    "I22": (paper.FIG_10_CURRENTS_MA, (2.7, 10.7, 40.9)),
    "I23": (paper.FIG_11_CURRENT_MA, 20.4),
    "I24": (paper.FIG_9_YAWS_DEG, (0, 40, 80)),
    "I25": (paper.FIG_12_SPEEDS_M_PER_S, (0.105, 0.209, 0.314)),
    "I26": (paper.FIG_14_SPEEDS_RPM, (16, 32, 64)),
}
OF_THE_TRIALS = {"I16", "I17", "I27", "F8.0", "F9.0", "F12.0", "F14.0"}  # see tests of the grids
NO_VALUE_OF_OURS = {"P11", "F8.8"}  # a camera that the package does not have; a law that the model takes over


@pytest.mark.parametrize("name", VALUES)
def test_the_package_uses_the_papers_value(name: str) -> None:
    ours, stated = VALUES[name]
    assert ours == pytest.approx(stated)


def test_luminance_is_proportional_to_current() -> None:
    """F8.8: the paper says "almost directly proportional"; the model leaves out the "almost"."""
    ratios = [Marker(current_ma=current).luminance_ratio for current in paper.FIG_8_CURRENTS_MA]
    np.testing.assert_allclose(ratios, np.array(paper.FIG_8_CURRENTS_MA) / 10.7)


def test_a_packet_begins_with_three_bits_off_and_fills_14_ms() -> None:
    for payload in (0, 0x25, 255):
        chips = encode_packet(payload, PACKET)
        assert chips.size * PACKET.chip_us == 14_000
        assert not chips[:6].any()


def test_what_is_used_as_stated_is_listed_here_and_nothing_else() -> None:
    judged = judge_claims(read_claims(), paper_world())
    used = set(judged.loc[judged["verdict"] == "used as stated", "id"])
    assert used == set(VALUES) | OF_THE_TRIALS | NO_VALUE_OF_OURS
    assert used <= set(FACTS)


def test_a_changed_default_is_not_called_used_as_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    claims = read_claims()
    panned = paper_world()["12"]
    other = judge_claims(claims[claims["id"] == "I25"], {"12": panned[panned["speed_m_per_s"] != 0.209]})
    assert other["verdict"].item() == "contradicted"
