"""The check of an answer prints one line and never stops a run."""

import numpy as np
import pytest

from bicode_studies.notebook import check_answer


def unfinished(bits):
    """Stand for an exercise that the reader has not begun."""
    return ...


@pytest.mark.parametrize(
    ("answer", "test", "said"),
    [
        (None, bool, "not attempted yet"),
        (..., bool, "not attempted yet"),
        (unfinished, lambda f: f([1]), "not attempted yet"),
        (3, lambda a: a == 3, "correct"),
        (np.array([1, 2]), lambda a: a == [1, 2], "correct"),
        (4, lambda a: a == 3, "not yet: think"),
        ("x", lambda a: a + 1 == 3, "not yet: think (the check stopped with TypeError"),
    ],
)
def test_an_answer_gets_one_line(capsys, answer, test, said):
    check_answer(answer, test, "think")
    printed = capsys.readouterr().out
    assert printed.startswith(said)
    assert printed.count("\n") == 1
