//! Is the mesh that a grid keeps the one that it was baked from? Exact contacts are measured by it.

use sdf_bake::{MeshDistance, SignMethod, TriangleMesh};
use sdf_formats::grid_file::{About, StoredMesh};

use super::sampling::{Surface, points_of};
use crate::args::VerifyArgs;
use crate::report::number;

/// Tolerance of points on either mesh, as a fraction of the diagonal.
const TOLERANCE: f64 = 1e-6;

/// Why the kept mesh is not that of the file. `mesh` is the mesh as it was baked, `truth` its distance; of the very file that was baked every number
/// has to agree, of others the surfaces.
pub fn fault(
    args: &VerifyArgs,
    kept: &StoredMesh,
    about: &About,
    mesh: &TriangleMesh,
    truth: &MeshDistance,
    is_same_file: bool,
) -> Option<String> {
    let StoredMesh { vertices, triangles, is_sign_continuous } = kept;
    if is_same_file {
        let (baked_vertices, baked_triangles) = mesh.packed();
        if (vertices, triangles) != (&baked_vertices, &baked_triangles) {
            return Some("the kept mesh is not the one that was baked".to_owned());
        }
        let words = &about.options;
        let method = match () {
            () if words.contains("--sign pseudo-normal") => Some(SignMethod::PseudoNormal),
            () if words.contains("--sign winding") => Some(SignMethod::Winding),
            () => None,
        };
        let is_continuous = MeshDistance::new(mesh, method).is_continuous();
        let says = if *is_sign_continuous { "closed" } else { "open" };
        return (is_continuous != *is_sign_continuous).then(|| format!("the kept mesh counts as {says}, and is not"));
    }
    let Ok(kept) = TriangleMesh::new(vertices, triangles) else { return Some("the kept mesh is none".to_owned()) };
    let kept_distance = MeshDistance::new(&kept, Some(SignMethod::Winding));
    let farthest = |from: &TriangleMesh, to: &MeshDistance| {
        let points = points_of(args, &Surface::new(from));
        points.iter().map(|point| to.signed_distance(*point).abs()).fold(0.0, f64::max)
    };
    let apart = farthest(&kept, truth).max(farthest(mesh, &kept_distance));
    let is_beside = apart > TOLERANCE * truth.bounds().diagonal();
    is_beside.then(|| format!("the kept mesh is another by {}", number(apart)))
}
