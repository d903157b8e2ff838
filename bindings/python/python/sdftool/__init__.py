"""Signed distance fields of meshes, and contacts of meshes with them.

Distances are NEGATIVE INSIDE and positive outside, in the unit of the mesh. (trimesh.proximity and pysdf are positive inside.)

    import sdftool, trimesh
    body = sdftool.bake(trimesh.load("dragon.obj"), res=128)
    distances, gradients = body.sample(points)
    contacts = body.contacts(trimesh.load("cloth.obj"), margin=0.01)
    contacts["distance"], contacts["point"], contacts["normal"]
"""

from ._sdftool import (
    ELEMENT_NAMES,
    STATUS_NAMES,
    CudaColumn,
    CudaContacts,
    CudaQuery,
    MeshClusters,
    Overlap,
    Sdf,
    __version__,
    bake,
    bowl,
    capsule,
    clear_leftovers,
    cone,
    contact_dtype,
    cuboid,
    cylinder,
    ellipsoid,
    from_bytes,
    half_space,
    horseshoe,
    import_grid,
    load,
    octahedron,
    reduce,
    rounded_box,
    signed_distance,
    sphere,
    torus,
    union,
)

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
