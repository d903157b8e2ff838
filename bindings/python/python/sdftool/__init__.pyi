"""Signed distance fields of meshes, negative inside, and contacts of meshes with them."""

import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Literal, Protocol, final, overload

import numpy as np
import numpy.typing as npt

__all__ = [
    "ELEMENT_NAMES",
    "STATUS_NAMES",
    "CudaColumn",
    "CudaContacts",
    "CudaQuery",
    "MeshClusters",
    "Overlap",
    "Sdf",
    "__version__",
    "bake",
    "bowl",
    "capsule",
    "clear_leftovers",
    "cone",
    "contact_dtype",
    "cuboid",
    "cylinder",
    "ellipsoid",
    "from_bytes",
    "half_space",
    "horseshoe",
    "import_grid",
    "load",
    "octahedron",
    "reduce",
    "rounded_box",
    "signed_distance",
    "sphere",
    "torus",
    "union",
]

__version__: str
STATUS_NAMES: list[str]
ELEMENT_NAMES: list[str]
contact_dtype: np.dtype[np.void]

class _TriMesh(Protocol):
    """trimesh.Trimesh and alike."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _Open3dMesh(Protocol):
    """open3d.geometry.TriangleMesh and alike."""

    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...

class _CardArray(Protocol):
    """An array on an NVIDIA GPU: of CuPy, PyTorch, Warp, Numba and alike."""

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...

_Mesh = _TriMesh | _Open3dMesh
_Path = str | bytes | os.PathLike[str] | os.PathLike[bytes]
_Floats = npt.NDArray[np.float64]
_Vector = Sequence[float] | npt.NDArray[Any]
_Pose = npt.ArrayLike | tuple[_Vector, _Vector]
_Sign = Literal["auto", "pseudo-normal", "winding"]
_Method = Literal["auto", "certified", "fw", "pgd", "newton", "gss"]
_Elements = Literal["faces", "edges", "vertices"]
_Format = Literal["nvdb", "raw", "npy", "nrrd", "vtkhdf", "glb", "blob", "c", "rust"]

@final
class Sdf:
    """A signed distance field, negative inside: a baked grid or a closed form."""

    def __call__(self, points: npt.ArrayLike, *, threads: int | None = None) -> _Floats: ...
    @overload
    def sample(
        self, points: npt.ArrayLike, *, status: Literal[False] = False, threads: int | None = None
    ) -> tuple[_Floats, _Floats]: ...
    @overload
    def sample(
        self, points: npt.ArrayLike, *, status: Literal[True], threads: int | None = None
    ) -> tuple[_Floats, _Floats, npt.NDArray[np.uint8]]: ...
    @overload
    def sample(
        self, points: npt.ArrayLike, *, status: bool, threads: int | None = None
    ) -> tuple[_Floats, _Floats] | tuple[_Floats, _Floats, npt.NDArray[np.uint8]]: ...
    @overload
    def contacts(
        self,
        mesh: _Mesh | npt.ArrayLike | _CardArray,
        faces: npt.ArrayLike | _CardArray | None = None,
        *,
        margin: float = 0.0,
        method: _Method = "auto",
        elements: _Elements = "faces",
        pose: _Pose | None = None,
        all_minima: bool = False,
        complete: bool = False,
        exact: bool = False,
        one_per_feature: bool = False,
        lean: bool = False,
        budget: int | None = None,
        tolerance: float = 1e-3,
        threads: int | None = None,
        clusters: MeshClusters | None = None,
        mesh_pose: _Pose | None = None,
        margins: npt.ArrayLike | None = None,
        device: Literal["cpu", "cuda"] = "cpu",
        kernels: _Path | None = None,
        counts: Literal[False] = False,
    ) -> npt.NDArray[np.void]: ...
    @overload
    def contacts(
        self,
        mesh: _Mesh | npt.ArrayLike | _CardArray,
        faces: npt.ArrayLike | _CardArray | None = None,
        *,
        margin: float = 0.0,
        method: _Method = "auto",
        elements: _Elements = "faces",
        pose: _Pose | None = None,
        all_minima: bool = False,
        complete: bool = False,
        exact: bool = False,
        one_per_feature: bool = False,
        lean: bool = False,
        budget: int | None = None,
        tolerance: float = 1e-3,
        threads: int | None = None,
        clusters: MeshClusters | None = None,
        mesh_pose: _Pose | None = None,
        margins: npt.ArrayLike | None = None,
        device: Literal["cpu", "cuda"] = "cpu",
        kernels: _Path | None = None,
        counts: Literal[True],
    ) -> tuple[npt.NDArray[np.void], dict[str, int | None]]: ...
    @overload
    def contacts(
        self,
        mesh: _Mesh | npt.ArrayLike | _CardArray,
        faces: npt.ArrayLike | _CardArray | None = None,
        *,
        margin: float = 0.0,
        method: _Method = "auto",
        elements: _Elements = "faces",
        pose: _Pose | None = None,
        all_minima: bool = False,
        complete: bool = False,
        exact: bool = False,
        one_per_feature: bool = False,
        lean: bool = False,
        budget: int | None = None,
        tolerance: float = 1e-3,
        threads: int | None = None,
        clusters: MeshClusters | None = None,
        mesh_pose: _Pose | None = None,
        margins: npt.ArrayLike | None = None,
        device: Literal["cpu", "cuda"] = "cpu",
        kernels: _Path | None = None,
        counts: bool,
    ) -> npt.NDArray[np.void] | tuple[npt.NDArray[np.void], dict[str, int | None]]: ...
    def cuda_query(
        self,
        mesh: _Mesh | npt.ArrayLike | _CardArray,
        faces: npt.ArrayLike | _CardArray | None = None,
        *,
        margin: float = 0.0,
        method: _Method = "auto",
        elements: _Elements = "faces",
        pose: _Pose | None = None,
        one_per_feature: bool = False,
        lean: bool = False,
        budget: int | None = None,
        tolerance: float = 1e-3,
        threads: int | None = None,
        kernels: _Path | None = None,
    ) -> CudaQuery: ...
    def first_touches(
        self,
        mesh: _Mesh | npt.ArrayLike,
        faces: npt.ArrayLike | None = None,
        *,
        end: npt.ArrayLike,
        thickness: float = 0.0,
        elements: _Elements = "faces",
        pose: _Pose | None = None,
        end_pose: _Pose | None = None,
        tolerance: float | None = None,
        budget: int = 65536,
        threads: int | None = None,
    ) -> tuple[_Floats, npt.NDArray[np.void]]: ...
    def overlap(
        self,
        other: Sdf,
        *,
        pose: _Pose | None = None,
        other_pose: _Pose | None = None,
        margin: float = 0.0,
        tolerance: float = 1e-3,
        resolution: float | None = None,
    ) -> Overlap: ...
    def __or__(self, value: Sdf, /) -> Sdf: ...
    def __and__(self, value: Sdf, /) -> Sdf: ...
    def __sub__(self, value: Sdf, /) -> Sdf: ...
    def __ror__(self, value: Sdf, /) -> Sdf: ...
    def __rand__(self, value: Sdf, /) -> Sdf: ...
    def __rsub__(self, value: Sdf, /) -> Sdf: ...
    def smooth_union(self, other: Sdf, blend: float) -> Sdf: ...
    def offset(self, distance: float) -> Sdf: ...
    def shell(self, thickness: float) -> Sdf: ...
    def moved(
        self,
        translation: _Vector = ...,
        rotation: _Vector = ...,
        scale: float = 1.0,
    ) -> Sdf: ...
    def save(self, path: _Path) -> None: ...
    def export(
        self,
        path: _Path,
        format: _Format | None = None,
        *,
        res: int | None = None,
        band: int | None = None,
        threads: int | None = None,
    ) -> list[pathlib.Path]: ...
    def to_bytes(self) -> bytes: ...
    def __copy__(self) -> Sdf: ...
    def __deepcopy__(self, _memo: Any) -> Sdf: ...
    @property
    def layout(self) -> Literal["dense", "sparse", "closed form"]: ...
    @property
    def precision(self) -> Literal["f32", "u16", "u8"] | None: ...
    @property
    def spacing(self) -> float | None: ...
    @property
    def shape(self) -> tuple[int, int, int] | None: ...
    @property
    def bounds(self) -> tuple[list[float], list[float]]: ...
    @property
    def error_bound(self) -> float | None: ...
    @property
    def slope_bound(self) -> float: ...
    @property
    def band(self) -> float | None: ...
    @property
    def max_margin(self) -> float | None: ...
    @property
    def sign_method(self) -> Literal["pseudo-normal", "winding", "given"] | None: ...
    @property
    def sign_reason(self) -> str | None: ...
    @property
    def values(self) -> npt.NDArray[np.float32] | None: ...

@final
class MeshClusters:
    """The faces of a mesh in clusters of neighbours, for contacts frame after frame; vertices that moved need refitted: nothing checks that."""

    def __new__(cls, mesh: _Mesh | npt.ArrayLike, faces: npt.ArrayLike | None = None) -> MeshClusters: ...
    def refitted(self, vertices: npt.ArrayLike) -> MeshClusters: ...
    def __len__(self) -> int: ...

@final
class CudaQuery:
    """A field and a mesh that stay on an NVIDIA GPU, for contacts frame after frame."""

    @overload
    def contacts(self, *, counts: Literal[False] = False) -> npt.NDArray[np.void]: ...
    @overload
    def contacts(self, *, counts: Literal[True]) -> tuple[npt.NDArray[np.void], dict[str, int | None]]: ...
    @overload
    def contacts(
        self, *, counts: bool
    ) -> npt.NDArray[np.void] | tuple[npt.NDArray[np.void], dict[str, int | None]]: ...
    def contacts_on_card(self) -> CudaContacts: ...
    def set_points(self, points: npt.ArrayLike | _CardArray) -> None: ...
    def set_pose(self, pose: _Pose | None) -> None: ...
    @property
    def card(self) -> str: ...

@final
class CudaContacts:
    """Contacts that stay on the card, in no particular order."""

    STATUS_NAMES: ClassVar[list[str]]
    def __len__(self) -> int: ...
    def __getitem__(self, key: str, /) -> CudaColumn: ...
    def keys(self) -> list[str]: ...

@final
class CudaColumn:
    """A column of CudaContacts, an array on the card."""

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...

@final
class Overlap:
    """Where two fields touch; distances are negative inside."""

    @property
    def verdict(self) -> Literal["contact", "separated", "undecided"]: ...
    @property
    def lower_bound(self) -> float | None: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def distances(self) -> _Floats: ...
    @property
    def converged(self) -> bool: ...
    @property
    def area(self) -> float: ...
    @property
    def unknown(self) -> int: ...
    @property
    def complete(self) -> bool: ...
    @property
    def patch_points(self) -> _Floats: ...
    @property
    def patch_normals(self) -> _Floats: ...
    @property
    def patch_distances(self) -> _Floats: ...
    @property
    def patch_areas(self) -> _Floats: ...

def bake(
    mesh: _Mesh | npt.ArrayLike,
    faces: npt.ArrayLike | None = None,
    *,
    res: int | None = None,
    voxel_size: float | None = None,
    max_error: float | str | None = None,
    layout: Literal["dense", "sparse"] | None = None,
    sign: _Sign = "auto",
    band: int = 3,
    padding: int = 4,
    precision: Literal["f32", "u16", "u8"] | None = None,
    inner_faces: Literal["drop", "keep"] = "drop",
    keep_mesh: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Sdf: ...
@overload
def signed_distance(
    mesh: _Mesh, points: npt.ArrayLike, /, *, sign: _Sign = "auto", threads: int | None = None
) -> _Floats: ...
@overload
def signed_distance(
    mesh: _Mesh, *, points: npt.ArrayLike, sign: _Sign = "auto", threads: int | None = None
) -> _Floats: ...
@overload
def signed_distance(
    mesh: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    sign: _Sign = "auto",
    threads: int | None = None,
) -> _Floats: ...
def reduce(
    contacts: npt.NDArray[np.void], count: int, *, movement: float, thickness: float = 0.0
) -> tuple[npt.NDArray[np.void], float]: ...
def load(path: _Path) -> Sdf: ...
def clear_leftovers(path: _Path) -> None: ...
def from_bytes(data: bytes) -> Sdf: ...
def import_grid(
    path: _Path, *, spacing: float | None = None, origin: _Vector | None = None
) -> Sdf: ...
def sphere(radius: float) -> Sdf: ...
def half_space(normal: _Vector = ..., offset: float = 0.0) -> Sdf: ...
def cuboid(half_extents: _Vector) -> Sdf: ...
def rounded_box(half_extents: _Vector, radius: float) -> Sdf: ...
def capsule(a: _Vector, b: _Vector, radius: float) -> Sdf: ...
def cylinder(radius: float, half_height: float) -> Sdf: ...
def cone(half_angle: float, height: float) -> Sdf: ...
def torus(major_radius: float, minor_radius: float) -> Sdf: ...
def octahedron(size: float) -> Sdf: ...
def ellipsoid(radii: _Vector) -> Sdf: ...
def bowl(radius: float, cut_height: float, thickness: float) -> Sdf: ...
def horseshoe(radius: float, thickness: float, bend: float, leg: float, half_depth: float) -> Sdf: ...
def union(fields: Sequence[Sdf]) -> Sdf: ...
