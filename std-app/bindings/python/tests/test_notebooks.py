"""Notebooks, run from their folder."""

import shutil
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
EXTRAS = {"daylight": "pyradiance", "denoising": "pyoidn", "lightmap": "matplotlib"}


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.ipynb")), ids=lambda file: file.stem)
def test_notebooks_run(file, tmp_path):
    pytest.importorskip("ipykernel")
    if file.stem in EXTRAS:
        pytest.importorskip(EXTRAS[file.stem])
    # Scenes are found by relative paths; pictures must not land in the repository.
    folder = tmp_path / "a" / "b" / "c" / "notebooks"
    folder.mkdir(parents=True)
    shutil.copytree(FOLDER.parents[3] / "scenes" / "cornell", tmp_path / "scenes" / "cornell")
    notebook = nbformat.read(file, as_version=4)
    done = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    if file.stem in ("picture", "lightmap"):
        outputs = [output for cell in done.cells if cell.cell_type == "code" for output in cell.outputs]
        shown = next(output for output in outputs if "image/png" in output.get("data", {}))
        assert file.stem != "picture" or "relMSE" in shown["data"]["text/html"]
