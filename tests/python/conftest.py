"""Where the robots are, and a log to read."""

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["TANDEM_BUILD"])


@pytest.fixture
def config():
    return ROOT / "config"


@pytest.fixture(scope="session")
def log_file(tmp_path_factory):
    """Of a run of the double pendulum, by the program."""
    folder = tmp_path_factory.mktemp("logs")
    subprocess.run(
        [BUILD / "bin/tandem", "run", ROOT / "config/double_pendulum/trajectory.toml", "--duration", "2",
         "--no-socket", "--no-dds", "--quiet", "--log", folder],
        check=True,
    )  # fmt: skip
    return next(folder.glob("*.mcap"))
