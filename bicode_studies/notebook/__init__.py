"""What every notebook needs: the drawing style, saved figures, the check of an answer, the repository's folders.

The other files run notebooks: ``parameters`` reads and checks the parameters of a notebook, ``runner`` runs notebooks
without a browser, ``pages`` writes them as HTML, ``run_times`` keeps how long each of them takes.
"""

from bicode_studies.notebook.exercises import check_answer
from bicode_studies.notebook.figures import save_figure, use_style
from bicode_studies.repository import figures_folder, repository_root, results_folder

__all__ = ["check_answer", "figures_folder", "repository_root", "results_folder", "save_figure", "use_style"]
