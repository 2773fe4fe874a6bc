"""What `import tandem` says where its C++ half is not there, or is another Python's."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

import tandem

SOURCES = pathlib.Path(tandem.__file__).resolve().parent


@pytest.mark.parametrize(
    "name, words",
    [
        (None, "ImportError: tandem was not built: no _native*.so in {folder} (in Tandem's folder: "),
        ("_native.cpython-27-none.so", "was built for another Python: _native.cpython-27-none.so in "
                                       "{folder}, and this is Python 3."),
        ("_native.abi3.so", "(docs/python.md says what tandem needs)"),  # of this Python, and no library
    ],
)  # fmt: skip
def test_it_says_why_it_cannot_be_imported(tmp_path, name, words):
    folder = tmp_path / "tandem"
    folder.mkdir()
    for file in SOURCES.glob("*.py"):
        shutil.copy(file, folder)
    if name:
        (folder / name).write_text("no library")
    ended = subprocess.run(
        [sys.executable, "-B", "-c", "import tandem"], capture_output=True, text=True,
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert ended.returncode == 1
    assert words.format(folder=folder) in ended.stderr.splitlines()[-1], ended.stderr
    assert "docs/python.md" in ended.stderr
