"""Types of the engine; its docstrings say shapes, units and errors."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, TypedDict, Union, final

import numpy as np
import numpy.typing as npt
from typing_extensions import TypeAlias

__all__ = [
    "Calibration",
    "Camera",
    "Found",
    "HeightMap",
    "Live",
    "Recipe",
    "Recording",
    "Scan",
    "Simulation",
    "Station",
    "Template",
    "__version__",
    "calibrate_camera",
    "calibrate_hand_eye",
    "calibrate_laser_plane",
    "find",
    "match_template",
    "notations",
    "numbers_from_pose",
    "picture_points",
    "pose_from_numbers",
    "scan",
    "simulate",
    "teach",
]
__version__: str

_Array: TypeAlias = npt.NDArray[Any]
_Floats: TypeAlias = npt.NDArray[np.float64]
_Path: TypeAlias = Union[str, PathLike[str]]
_Progress: TypeAlias = Callable[[int, Union[int, None]], object]
_Station: TypeAlias = Union[Station, _Path]
_Recording: TypeAlias = Union[Recording, _Path]

class _Matrix(Protocol):
    def as_matrix(self) -> _Array: ...

_Pose: TypeAlias = Union[npt.ArrayLike, _Matrix, tuple[Union[npt.ArrayLike, _Matrix], npt.ArrayLike]]

class _Match(TypedDict):
    x_px: float
    y_px: float
    angle_deg: float
    scale: float
    score: float
    sigma_px: list[float]
    sigma_deg: float
    sigma_scale: float
    edges: int
    edge_rms_px: float
    second_score: float
    correlation: float | None
    warning: str | None

@final
class Calibration:
    @property
    def kind(self) -> str: ...
    @property
    def value(self) -> Any: ...
    @property
    def parameters(self) -> list[str]: ...
    @property
    def covariance(self) -> _Floats: ...
    def sigma(self, parameter: str) -> float | None: ...
    @property
    def verdict(self) -> str: ...
    @property
    def reasons(self) -> list[str]: ...
    @property
    def advice(self) -> list[str]: ...
    @property
    def figures(self) -> dict[str, float]: ...
    @property
    def per_picture(self) -> list[tuple[str, float]]: ...
    @property
    def remarks(self) -> list[str]: ...
    @property
    def inputs(self) -> dict[str, str]: ...
    @property
    def created(self) -> str: ...
    @property
    def left_out(self) -> list[tuple[str, str]]: ...
    @property
    def residuals(self) -> dict[str, _Floats]: ...
    @property
    def page(self) -> str | None: ...
    def store(self, station: _Path, *, keep_badly_determined: bool = False) -> Path: ...

@final
class Camera:
    @staticmethod
    def from_opencv(matrix: npt.ArrayLike, distortion: npt.ArrayLike, size: tuple[int, int]) -> Camera: ...
    @property
    def matrix(self) -> _Floats: ...
    @property
    def distortion(self) -> _Floats: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def project(self, points: npt.ArrayLike) -> _Floats: ...
    def rays(self, pixels: npt.ArrayLike) -> _Floats: ...

@final
class Found:
    @property
    def passed(self) -> bool: ...
    @property
    def reasons(self) -> list[str]: ...
    @property
    def base_from_part(self) -> _Floats: ...
    @property
    def insertion(self) -> _Floats | None: ...
    @property
    def numbers(self) -> dict[str, list[float]] | None: ...
    @property
    def sigma_mm(self) -> list[float]: ...
    @property
    def sigma_deg(self) -> list[float]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def picture(self) -> npt.NDArray[np.uint8]: ...

@final
class HeightMap:
    @property
    def z(self) -> npt.NDArray[np.float32]: ...
    @property
    def sigma(self) -> npt.NDArray[np.float32]: ...
    @property
    def intensity(self) -> npt.NDArray[np.float32]: ...
    @property
    def count(self) -> npt.NDArray[np.uint32]: ...
    @property
    def cell_mm(self) -> float: ...
    @property
    def base_from_grid(self) -> _Floats: ...
    @property
    def shape(self) -> tuple[int, int]: ...

@final
class Live:
    def __new__(
        cls, station: _Station, size: tuple[int, int], *, bits: int | None = None, on: str = "auto"
    ) -> Live: ...
    def measure(self, picture: _Array) -> _Array | None: ...
    @property
    def ran_on(self) -> str: ...

@final
class Recipe:
    def __new__(cls, file: _Path) -> Recipe: ...
    @staticmethod
    def parse(text: str) -> Recipe: ...
    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...

@final
class Recording:
    def __new__(cls, folder: _Path, *, poses: str | None = None) -> Recording: ...
    @property
    def folder(self) -> Path: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def bits(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def laser(self) -> list[str]: ...
    @property
    def ambient(self) -> list[str]: ...
    def picture(self, name: str) -> _Array: ...
    def flange_poses(self) -> list[_Floats]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> tuple[_Array, _Floats]: ...

@final
class Scan:
    @staticmethod
    def open(folder: _Path) -> Scan: ...
    @property
    def points(self) -> _Array: ...
    @property
    def map(self) -> HeightMap | None: ...
    @property
    def folder(self) -> Path | None: ...
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def frame(self) -> str: ...
    @property
    def camera_places(self) -> list[tuple[int, _Floats]]: ...
    @property
    def remarks(self) -> list[str]: ...

@final
class Simulation:
    @property
    def folder(self) -> Path: ...
    @property
    def sets(self) -> list[str]: ...
    @property
    def station(self) -> Station: ...
    def recording(self, set: str = "scan") -> Recording: ...
    def truth(self, set: str = "scan") -> dict[str, Any]: ...
    def distances(self, points: npt.ArrayLike, set: str = "scan") -> _Floats: ...

@final
class Station:
    def __new__(cls, folder: _Path) -> Station: ...
    @staticmethod
    def from_values(
        camera: Camera,
        normal: Sequence[float] | _Array,
        offset_mm: float,
        *,
        flange_from_camera: _Pose | None = None,
        base_from_camera: _Pose | None = None,
        folder: _Path | None = None,
    ) -> Station: ...
    @property
    def folder(self) -> Path | None: ...
    @property
    def camera(self) -> Calibration | None: ...
    @property
    def laser_plane(self) -> Calibration | None: ...
    @property
    def pointer(self) -> Calibration | None: ...
    @property
    def hand_eye(self) -> Calibration | None: ...
    @property
    def base_camera(self) -> Calibration | None: ...
    @property
    def linear_axis(self) -> Calibration | None: ...
    @property
    def turntable(self) -> Calibration | None: ...

@final
class Template:
    @staticmethod
    def teach(
        name: str,
        picture: _Array,
        region: Sequence[int] | None = None,
        *,
        bits: int | None = None,
        contrast: float | None = None,
    ) -> Template: ...
    @staticmethod
    def load(file: _Path) -> Template: ...
    @property
    def text(self) -> str: ...
    @property
    def name(self) -> str: ...

def calibrate_camera(
    recordings: _Recording | list[_Recording] | tuple[_Recording, ...],
    *,
    lens: str = "evidence",
    skew: bool = False,
    board: str = "evidence",
    working_mm: float | None = None,
    progress: _Progress | None = None,
) -> Calibration: ...
def calibrate_hand_eye(
    recording: _Recording,
    station: _Station,
    *,
    poses: str | None = None,
    mount: str | None = None,
    robot_sigma_mm: float | None = None,
    robot_sigma_deg: float | None = None,
    working_mm: float | None = None,
    progress: _Progress | None = None,
) -> Calibration: ...
def calibrate_laser_plane(
    recording: _Recording,
    station: _Station,
    *,
    near_mm: float | None = None,
    far_mm: float | None = None,
    on: str = "auto",
    progress: _Progress | None = None,
) -> Calibration: ...
def find(
    scan: Scan | _Path,
    recipe: Recipe | _Path,
    station: _Station | None = None,
    *,
    notation: str = "matrix",
    all: bool = False,
) -> Found: ...
def match_template(
    template: Template,
    picture: _Array,
    *,
    angles_deg: Sequence[float] | None = None,
    scales: Sequence[float] | None = None,
    min_score: float | None = None,
    weak_score: float | None = None,
    most: int = 1,
    max_overlap: float | None = None,
    ignore_polarity: bool = False,
    region: Sequence[float] | None = None,
    bits: int | None = None,
) -> list[_Match]: ...
def notations() -> dict[str, tuple[str, ...]]: ...
def numbers_from_pose(pose: _Pose, notation: str) -> list[float]: ...
def picture_points(picture: _Array, station: _Station, *, bits: int | None = None, on: str = "auto") -> _Array: ...
def pose_from_numbers(numbers: Sequence[float], notation: str) -> _Floats: ...
def scan(
    what: _Recording | _Array | Iterable[_Array] | Iterable[tuple[_Array, _Pose]],
    station: _Station,
    poses: npt.ArrayLike | Iterable[_Pose] | None = None,
    *,
    bits: int | None = None,
    ambient: _Array | None = None,
    out: _Path | None = None,
    on: str = "auto",
    skip_bad: bool = False,
    cell_mm: float | None = None,
    resume: bool = False,
    progress: _Progress | None = None,
) -> Scan: ...
def simulate(
    folder: _Path | None = None,
    *,
    sets: Sequence[str] = ...,
    shots: int = 200,
    size: tuple[int, int] | None = None,
    seed: int = 1,
    noise: float = 1.0,
    pose_noise_mm: float = 0.0,
    pose_noise_deg: float = 0.0,
    scene: _Path | None = None,
    poses: npt.ArrayLike | Iterable[_Pose] | None = None,
    progress: _Progress | None = None,
) -> Simulation: ...
def teach(
    scan: Scan | _Path,
    name: str,
    outline: Sequence[float],
    *,
    angle_deg: float = 0.0,
    windows: Sequence[Sequence[float]] = ...,
    holes: Sequence[Sequence[float]] = ...,
    tolerance_mm: float = 0.25,
    tolerance_deg: float = 0.5,
    approach_mm: float = 30.0,
    retract_mm: float = 60.0,
) -> tuple[Recipe, Found]: ...
