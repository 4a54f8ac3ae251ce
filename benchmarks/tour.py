"""The notebook tour with its outputs, executed by this interpreter in a folder that is removed afterwards.

python -m benchmarks.tour    examples/tour.ipynb anew
"""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

TOUR = Path(__file__).parent.parent / "examples" / "tour.ipynb"
KERNEL = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
LANGUAGE = {"language_info": {"name": "python"}}  # without its version
LIMIT = 120  # s, of a cell


def read() -> nbformat.NotebookNode:
    return nbformat.read(TOUR, as_version=4)


def executed(tour: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The same cells with what they print and show now. Raises CellExecutionError for one that raises."""
    made = nbformat.from_dict(tour)
    with TemporaryDirectory() as folder:
        kernel = AsyncKernelManager(
            kernel_spec_manager=KernelSpecManager(kernel_dirs=[]),  # none that is installed: that of ipykernel, here
            connection_file=f"{folder}/kernel.json",
            transport="ipc",
        )
        where = {"metadata": {"path": folder}}
        client = NotebookClient(made, km=kernel, timeout=LIMIT, record_timing=False, resources=where)
        apart = {"IPYTHONDIR": folder, "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
        client.execute(cleanup_kc=True, env=os.environ | apart)
    made.metadata = nbformat.from_dict(KERNEL | LANGUAGE)
    return made


if __name__ == "__main__":
    nbformat.write(executed(read()), TOUR)
