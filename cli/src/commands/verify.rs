//! Does a field agree with its mesh? Samples nodes and points, and compares them with the exact signed distance.
//!
//! | step | file |
//! |---|---|
//! | random points and nodes, the field's value and the exact distance there | `sampling` |
//! | errors over all samples | `findings` |
//! | beyond the band of a sparse grid | `far` |
//! | reasons why the field does not match | `faults` |
//! | the mesh that the grid keeps | `kept` |
//! | with `--tight`: tight error bounds of bricks | `tight` |
//! | rows and JSON | `summary` |

mod far;
mod faults;
mod findings;
mod kept;
mod sampling;
mod summary;
mod tight;

use std::time::Instant;

use anyhow::Result;
use sdf_bake::{MeshDistance, Repairs, SignMethod};
use sdf_core::grid::owned::Layout;
use sdf_core::{AnyField, Sdf};
use sdf_formats::blob_file::StoredBlob;
use sdf_formats::field_file::OpenField;
use sdf_formats::grid_file::StoredGrid;

use crate::args::VerifyArgs;
use crate::failure::{Mismatch, misuse};
use crate::histogram::Histogram;
use crate::mesh_input::{self, with_path};
use crate::read_summary::bytes_of;
use crate::{field_input, memory, output, progress};

use faults::faults;
use findings::{Errors, Findings, StatedGrid};
use sampling::{PointSample, Surface, point_in_box, sample};
use summary::Summary;
use tight::tight_bound;

/// The field to verify.
#[expect(clippy::large_enum_variant, reason = "there is one")]
enum Subject {
    Grid(StoredGrid),
    Blob(StoredBlob),
    Shapes(AnyField),
}

impl Subject {
    /// The grid and what its file states, or else the shapes.
    fn stated(&self) -> Result<StatedGrid<'_>, &AnyField> {
        match self {
            Self::Grid(StoredGrid { grid, sparse, about, .. }) => Ok(StatedGrid {
                grid,
                band: sparse.map(|sparse| sparse.band),
                error_bound: about.error_bound,
                error_regions: about.error_regions.as_ref(),
                slope_bound: about.slope_bound,
                padding: about.padding,
                has_exact_nodes: true,
            }),
            Self::Blob(StoredBlob { grid, padding, .. }) => Ok(StatedGrid {
                grid,
                band: (grid.storage().layout() == Layout::Sparse).then(|| grid.band()),
                error_bound: grid.global_error_bound(),
                error_regions: None,
                slope_bound: grid.slope_bound(),
                padding: *padding,
                has_exact_nodes: false,
            }),
            Self::Shapes(shapes) => Err(shapes),
        }
    }
}

pub fn run(args: &VerifyArgs) -> Result<()> {
    let started = Instant::now();
    if let Some(path) = &args.histogram {
        output::ensure_writable(path, &[&args.sdf, &args.mesh])?;
    }
    let bytes = f64::from(args.points) * size_of::<PointSample>() as f64;
    memory::require(bytes, &format!("--points {}", args.points), "use fewer")?;
    let input = mesh_input::read(&args.mesh)?;
    input.mesh.require_triangles(&mesh_input::shown(&args.mesh))?;
    let (subject, parts) = match field_input::open(&args.sdf)? {
        OpenField::Grid(reader) => {
            let parts = bytes_of(&reader.summary().parts);
            (Subject::Grid(reader.read()?), Some(parts))
        }
        OpenField::Blob(blob) => (Subject::Blob(blob), None),
        OpenField::Analytic(node) => (Subject::Shapes(node), None),
    };
    if args.tight {
        tight::require_bricks(&args.sdf, &subject)?;
    }
    if args.all_nodes && matches!(subject, Subject::Shapes(_)) {
        misuse!("{}: a closed form has no nodes: remove --all-nodes", mesh_input::shown(&args.sdf));
    }
    // As it was baked: welded and closed, without faces that lie inside of the solid. Neither blobs nor shapes say how.
    let about = match &subject {
        Subject::Grid(stored) => Some(&stored.about),
        Subject::Blob(_) | Subject::Shapes(_) => None,
    };
    let repairs = about.map_or_else(Repairs::default, |about| Repairs::from_words(&about.options));
    let mesh = with_path(&args.mesh, repairs.apply(&input.mesh.points, &input.mesh.triangles))?;
    let keeps_all = about.is_some_and(|about| about.options.contains("--inner-faces keep"));
    let pseudo_normal = sdf_formats::grid_file::SignMethod::PseudoNormal;
    let has_pseudo_normals = about.is_some_and(|about| about.sign_method == pseudo_normal);
    let mesh = match (keeps_all, has_pseudo_normals) {
        (true, _) => mesh,
        (false, true) => mesh.without_inner_shells(),
        (false, false) => mesh.without_inner_faces(),
    };
    let surface = Surface::new(&mesh);
    let same_mesh = about.map(|about| about.source.sha256 == input.facts.sha256);
    let (findings, samples, tight, kept_fault) = progress::on_threads(args.threads, || {
        // Signs are by winding numbers at every point, whichever method the file was signed by. Distances come from the
        // baker's own tree, which bake's tests compare with brute force and with parry3d.
        let truth = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        let (findings, samples) = match subject.stated() {
            Ok(stated) => Findings::from_grid(args, &stated, &truth, &surface),
            Err(shapes) => {
                let bounds = mesh.bounds().inflate(0.1 * mesh.bounds().diagonal());
                let samples = sample(args, shapes, &truth, |index| point_in_box(args.seed, index, &bounds));
                (Findings::from_points(Errors::new(&samples, 0.0, None)), samples)
            }
        };
        let bricks = subject.stated().ok().filter(|_| args.tight);
        let tight = bricks.and_then(|stated| stated.band.map(|band| tight_bound(stated.grid, band, &mesh)));
        let kept = match &subject {
            Subject::Grid(StoredGrid { mesh, about, .. }) => mesh.as_ref().map(|kept| (kept, about)),
            Subject::Blob(_) | Subject::Shapes(_) => None,
        };
        let is_same = same_mesh == Some(true);
        let kept_fault = kept.and_then(|(kept, about)| kept::fault(args, kept, about, &mesh, &truth, is_same));
        (findings, samples, tight, kept_fault)
    })?;
    let diagonal = mesh.bounds().diagonal();
    let spacing = subject.stated().ok().map(|stated| stated.grid.lattice().spacing());
    let mut faults = faults(&findings);
    faults.extend(kept_fault);
    let triangles = about.map(|about| about.source.triangles).filter(|_| same_mesh == Some(true));
    if let Some(stated) = triangles.filter(|stated| *stated != input.mesh.triangles.len() as u64) {
        faults.push(format!("the file states {stated} triangles of {}", input.mesh.triangles.len()));
    }
    if let Some(path) = &args.histogram {
        let (unit, length) = spacing.map_or(("of the diagonal", diagonal), |spacing| ("in voxels", spacing));
        let errors: Vec<f64> = samples.iter().map(|sample| sample.error() / length).collect();
        let title = format!("{} against {}", mesh_input::shown(&args.sdf), args.mesh.display());
        Histogram { title, unit, errors: &errors, bound: findings.bound.map(|bound| bound / length) }.write(path)?;
    }
    let elapsed = started.elapsed().as_secs_f64();
    let printed = Summary { findings: &findings, diagonal, spacing, same_mesh, parts, faults: &faults, tight, elapsed }
        .print(args);
    // The verdict does not depend on who reads the rows.
    if faults.is_empty() {
        return printed;
    }
    let (field, mesh) = (mesh_input::shown(&args.sdf), args.mesh.display());
    Err(Mismatch(format!("{field} does not match {mesh}: {}", faults.join("; "))).into())
}
