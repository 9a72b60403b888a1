"""Tests of the figure of a diagnosis."""

from matplotlib.figure import Figure

from bicode_lab.events import make_events, no_events
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.own_recording.diagnose import diagnose_period
from bicode_studies.own_recording.plots import draw_checks, draw_diagnosis, draw_state

SETTINGS = ReceiverSettings(width=64, height=48, detect_2d=False)


def test_five_views_over_one_axis_of_time():
    events = make_events([5, 5, 6, 6], [7] * 4, [1, 0, 1, 0], [100, 900, 5000, 9000])
    diagnosis = diagnose_period(events, 0, SETTINGS, box=(4, 5, 4, 4))
    axes = draw_diagnosis(diagnosis, Figure(figsize=(12, 7)))
    assert set(axes) == {"frame", "events", "counts", "checks", "chips"}
    assert {axes[name].get_xlim() for name in ("events", "counts", "chips")} == {(0.0, 33.0)}
    on, off = (line.get_ydata() for line in axes["counts"].get_lines()[:2])
    assert list(on) == list(diagnosis.n_on)
    assert list(off) == list(diagnosis.n_off)


def test_a_period_without_anything_can_be_drawn():
    axes = draw_diagnosis(diagnose_period(no_events(), 0, SETTINGS), Figure())
    assert not axes["chips"].get_lines()


def test_every_check_has_its_line_and_the_failed_one_its_words():
    diagnosis = diagnose_period(no_events(), 0, SETTINGS)
    ax = draw_checks(diagnosis.checks, Figure().subplots())
    texts = [text.get_text() for text in ax.texts]
    assert all(check.name in texts for check in diagnosis.checks)
    assert diagnosis.checks[0].found in texts
    assert draw_state(diagnosis, Figure().subplots()).get_ylabel() == "LED state"
