"""A simulated station that all tests share, and the program that they are compared with."""

from __future__ import annotations

import importlib
import os
import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import sheetlight

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Recordings whose reported poses scatter, so that a scan's refinement has something to do."""
    sets = ["scan", "intrinsics", "handeye", "laserplane"]
    folder = tmp_path_factory.mktemp("simulated")
    return sheetlight.simulate(folder, sets=sets, shots=120, seed=3, pose_noise_mm=0.02, pose_noise_deg=0.004)


@pytest.fixture(scope="session")
def station(made):
    return made.station


@pytest.fixture(scope="session")
def recording(made):
    return made.recording()


@pytest.fixture(scope="session")
def arrays(recording):
    """All pictures and poses of the scan."""
    pictures, poses = zip(*recording)
    return np.stack(pictures), np.stack(poses)


@pytest.fixture(scope="session")
def scanned(recording, station):
    return sheetlight.scan(recording, station, on="cpu")


@pytest.fixture(scope="session")
def by_program(made, tmp_path_factory):
    """The folder that the program makes of the same recording."""
    program = os.environ.get("SHEETLIGHT_PROGRAM")
    if program is None:
        pytest.skip("SHEETLIGHT_PROGRAM names no program to compare with")
    out = tmp_path_factory.mktemp("program") / "scan"
    arguments = ["scan", made.recording().folder, "--station", made.station.folder, "--out", out, "--on", "cpu"]
    subprocess.run([program, *map(str, arguments)], check=True, capture_output=True)
    return out


def needs(name: str, *, heavy: bool = False) -> ModuleType:
    """An optional package. A test without it is skipped and says so; on a build server only for heavy ones."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        if "CI" in os.environ and not heavy:
            raise
        pytest.skip(f"*** {name} is not installed: what uses it was not tested ({error}) ***")
