"""Tests of the video and the table of a recording."""

import cv2
import numpy as np
import pandas as pd
import pytest

from bicode_lab.events import make_events
from bicode_lab.recognition import ReceiverSettings, Sighting
from bicode_studies.own_recording.video import draw_pictures, write_table, write_video

SETTINGS = ReceiverSettings(width=64, height=48)
EVENTS = make_events([10, 20, 30, 63], [5, 6, 7, 47], [1, 0, 1, 0], [0, 10, 33_000, 65_999])
SIGHTINGS = [
    Sighting(t_us=0, track=3, x=20, y=20, w=10, h=8, id=37),
    Sighting(t_us=33_000, track=3, x=40, y=20, w=9, h=8),
]


def pictures(**changes):
    given = {"frame_us": 3000, "view": (0, 0, 64, 48), "scale": 4} | changes
    return list(draw_pictures(EVENTS, SIGHTINGS, SETTINGS, **given))


def test_there_is_a_picture_for_every_stretch_and_events_have_their_colours():
    found = pictures()
    assert len(found) == 22
    assert {picture.shape for picture in found} == {(192, 256, 3)}
    assert found[0][5 * 4 + 1, 10 * 4 + 1].tolist() == [255, 255, 255]
    assert found[0][6 * 4 + 1, 20 * 4 + 1].tolist() == [0xC9, 0x7E, 0x40]
    assert found[0][2, 2].tolist() == [0x34, 0x25, 0x1E]


def test_boxes_are_those_of_the_period():
    orange = np.array([0x00, 0x9F, 0xE6])
    found = pictures()
    assert (found[0][20 * 4 : 28 * 4, 20 * 4 : 30 * 4] == orange).all(axis=2).any()
    assert not (found[15] == orange).all(axis=2).any()  # no ID there: grey


def test_a_part_is_shown_from_its_corner():
    found = pictures(view=(8, 4, 32, 24), scale=1)
    assert found[0].shape == (24, 32, 3)
    assert found[0][1, 2].tolist() == [255, 255, 255]


def test_the_film_can_be_read_back(tmp_path):
    path = tmp_path / "new" / "film.mp4"
    n = write_video(path, EVENTS, SIGHTINGS, SETTINGS, max_frames=10)
    film = cv2.VideoCapture(str(path))
    assert n == 10
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 10
    assert (film.get(cv2.CAP_PROP_FRAME_WIDTH), film.get(cv2.CAP_PROP_FRAME_HEIGHT)) == (640, 480)
    ok, picture = film.read()
    assert ok
    assert picture[55, 105].min() > 200  # the ON event, after compression


@pytest.mark.parametrize("fps", [10.0, 25.0])
def test_the_film_has_the_pictures_per_second_that_were_asked_for(tmp_path, fps):
    path = tmp_path / "film.mp4"
    write_video(path, EVENTS, SIGHTINGS, SETTINGS, fps=fps, zoom=(8, 4, 32, 24), max_frames=2)
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FPS) == pytest.approx(fps)


def test_another_ending_is_refused(tmp_path):
    with pytest.raises(ValueError, match="mp4"):
        write_video(tmp_path / "film.avi", EVENTS, SIGHTINGS, SETTINGS)


def test_the_table_has_a_row_a_sighting(tmp_path):
    path = write_table(tmp_path / "sightings.csv", SIGHTINGS)
    table = pd.read_csv(path)
    assert table.track.tolist() == [3, 3]
    assert table.id.tolist()[0] == 37
    assert table.id.isna().tolist() == [False, True]
