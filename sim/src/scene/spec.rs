//! Keys of a scene file. Unknown ones are errors. Lengths, times and masses are in units of the scene's own.

use std::path::PathBuf;

use sdf_core::cage::CageMap;
use serde::Deserialize;

use super::mesh_spec::MeshSpec;
use crate::world::DAMPING;

/// A scene.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// The file, as errors have it; no key.
    #[serde(skip)]
    pub name: String,
    /// One line that says what happens.
    pub title: String,
    /// How many frames are shown.
    pub frames: u32,
    /// Frames per unit of time.
    #[serde(default = "sixty")]
    pub rate: f64,
    /// Steps per frame.
    #[serde(default = "ten")]
    pub substeps: u32,
    /// Acceleration of everything.
    #[serde(default = "down")]
    pub gravity: [f64; 3],
    /// Distance that is kept.
    #[serde(default)]
    pub thickness: f64,
    /// Coulomb's coefficient.
    #[serde(default = "third")]
    pub friction: f64,
    /// Lever of the rolling friction of rigid bodies, a length.
    #[serde(default)]
    pub rolling_friction: f64,
    /// Speed at which overlaps are undone.
    #[serde(default = "one")]
    pub recovery: f64,
    /// Rate at which everything loses speed: in the time t about the share 1 − exp(−drag · t).
    #[serde(default)]
    pub drag: f64,
    /// Time of the dashpots beside all distances; 0 for none.
    #[serde(default = "dashpot")]
    pub damping: f64,
    /// Rounds over edges that carry much, at either end of a step.
    #[serde(default)]
    pub loaded_rounds: u32,
    /// Contacts are searched without a margin for what moves.
    #[serde(default)]
    pub no_margin: bool,
    /// Each connected patch of deep contacts leaves on one side.
    #[serde(default)]
    pub choose_side: bool,
    /// Deep faces are those of the worst frame, not of the last.
    #[serde(default)]
    pub every_frame: bool,
    /// Most contacts of a rigid body with each other one; all by default.
    pub contacts_per_pair: Option<usize>,
    /// Number to begin random poses from.
    #[serde(default)]
    pub seed: u64,
    /// Sheets, nets and strings.
    #[serde(default)]
    pub cloth: Vec<ClothSpec>,
    /// Rigid bodies.
    #[serde(default)]
    pub rigid: Vec<RigidSpec>,
    /// Soft bodies.
    #[serde(default)]
    pub soft: Vec<SoftSpec>,
    /// Fields that nothing moves.
    #[serde(default)]
    pub obstacle: Vec<ObstacleSpec>,
    /// A region that no vertex may end in.
    pub beyond: Option<Beyond>,
    /// Largest values of the figures that count as reached.
    #[serde(default)]
    pub reach: Reach,
    /// Methods that must fail, each with the least number of deep faces, or of vertices beyond; of a scene that wants runs freed
    /// or calm, of runs that are not.
    #[serde(default)]
    pub fails: std::collections::BTreeMap<String, usize>,
    /// Lists of values: the scene is run with each combination.
    #[serde(default)]
    pub vary: Vary,
}

fn sixty() -> f64 {
    60.0
}
fn ten() -> u32 {
    10
}
fn down() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}
fn third() -> f64 {
    0.3
}
fn one() -> f64 {
    1.0
}
fn cells() -> u32 {
    64
}
fn soft_cells() -> u32 {
    48
}
fn dashpot() -> f64 {
    DAMPING
}
fn weak() -> f64 {
    1e-3
}

/// Where and how something begins.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    /// Moved so far, after it is turned.
    pub translate: [f64; 3],
    /// Turned by so many degrees about x, then y, then z.
    pub turn: [f64; 3],
    /// Velocity.
    pub velocity: [f64; 3],
    /// Rigid bodies: angular velocity.
    pub spin: [f64; 3],
    /// Turned and moved at random, by the scene's seed; moved by so much along each axis.
    pub random: Option<f64>,
}

/// A sheet, a net or strings.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClothSpec {
    /// The mesh; its lengths are those at rest.
    pub mesh: MeshSpec,
    /// Pose and velocity.
    #[serde(default)]
    pub start: Start,
    /// Mass of all of it.
    #[serde(default = "one")]
    pub mass: f64,
    /// Compliance along edges.
    #[serde(default)]
    pub stretch: f64,
    /// Compliance across edges.
    #[serde(default = "weak")]
    pub bend: f64,
    /// Vertices that are held.
    #[serde(default)]
    pub pins: Vec<u32>,
}

/// A rigid body, or several alike.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigidSpec {
    /// The mesh, closed.
    pub mesh: MeshSpec,
    /// Pose and velocity of the first.
    #[serde(default)]
    pub start: Start,
    /// Mass of each.
    #[serde(default = "one")]
    pub mass: f64,
    /// Cells of the grid that is baked from the mesh.
    #[serde(default = "cells")]
    pub cells: u32,
    /// How many along x, y and z.
    #[serde(default = "single")]
    pub count: [u32; 3],
    /// Distance from one to the next.
    #[serde(default)]
    pub apart: [f64; 3],
}

fn single() -> [u32; 3] {
    [1; 3]
}

/// A soft body.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoftSpec {
    /// The mesh, closed.
    pub mesh: MeshSpec,
    /// Pose and velocity.
    #[serde(default)]
    pub start: Start,
    /// Side of the cubes that are cut into tetrahedra.
    pub cell: f64,
    /// Mass per volume of the mesh.
    pub density: f64,
    /// Young's modulus.
    pub young: f64,
    /// Poisson's ratio, below ½.
    pub poisson: f64,
    /// Tetrahedra reach so far beyond the mesh.
    #[serde(default)]
    pub padding: f64,
    /// Cells of the grid of its field along the mesh's longest side.
    #[serde(default = "soft_cells")]
    pub cells: u32,
    /// Others touch it: its field at rest is carried by the tetrahedra.
    pub touched: Option<CageMapSpec>,
}

/// The map from the world to a soft body at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CageMapSpec {
    /// Each face piece by piece, by the tetrahedra that it meets.
    Exact,
    /// All of a face by the tetrahedron of its centroid (§5.3 of the paper).
    Frozen,
}

/// A field that nothing pushes: from a mesh, from a file, or the text of a closed form.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSpec {
    /// A mesh to bake.
    pub mesh: Option<MeshSpec>,
    /// Cells of the grid along the mesh's longest side; only a mesh has them.
    pub cells: Option<u32>,
    /// The text of a closed form, as in a `.sdf.toml`.
    pub shape: Option<String>,
    /// The same shape with other parameters: it swings between the two.
    pub becomes: Option<String>,
    /// Time in which it gets there and back, 1 where nothing is said.
    pub period: Option<f64>,
    /// A grid or closed form beside the scene's file.
    pub file: Option<PathBuf>,
    /// Where it stands.
    #[serde(default)]
    pub translate: [f64; 3],
}

impl ObstacleSpec {
    /// Cells of the grid of its mesh.
    pub fn grid_cells(&self) -> u32 {
        self.cells.unwrap_or_else(cells)
    }
}

/// A region that no vertex may end in.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beyond {
    /// Below this z.
    pub below: Option<f64>,
    /// Nearer to the origin than this.
    pub nearer: Option<f64>,
}

/// Largest values of figures; those not given are not asked for.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Reach {
    /// Faces deeper than a quarter of the thickness.
    pub deep_faces: Option<usize>,
    /// Depth of the deepest.
    pub deepest: Option<f64>,
    /// Longest length over its length at rest.
    pub stretch: Option<f64>,
    /// Speed at rest.
    pub jitter: Option<f64>,
    /// Way of a vertex in the last half unit of time.
    pub drift: Option<f64>,
    /// Turn of a normal within a frame, in degrees.
    pub turn: Option<f64>,
    /// Energy above the start.
    pub energy_gain: Option<f64>,
    /// Change of momentum.
    pub momentum_error: Option<f64>,
    /// Vertices where none may be.
    pub beyond: Option<usize>,
    /// Smallest det F.
    pub volume: Option<f64>,
    /// Smallest share of runs that end without deep faces.
    pub freed: Option<f64>,
    /// Most runs that end with more deep faces than they began with.
    pub worse: Option<usize>,
    /// Smallest share of runs without a speed above `calm_speed`.
    pub calm: Option<f64>,
    /// Speed above which a run is not calm.
    pub calm_speed: Option<f64>,
}

/// Values to combine; an empty list keeps the scene's own.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vary {
    /// Frames per unit of time.
    pub rate: Vec<f64>,
    /// Steps per frame.
    pub substeps: Vec<u32>,
    /// Coulomb's coefficients.
    pub friction: Vec<f64>,
    /// Distances to keep.
    pub thickness: Vec<f64>,
    /// Speeds at which overlaps are undone.
    pub recovery: Vec<f64>,
    /// Factors of the mass of every other vertex of all sheets.
    pub mass_ratio: Vec<f64>,
    /// Factors of all velocities.
    pub speed: Vec<f64>,
    /// So many runs, seeds counted from the scene's.
    pub seeds: u32,
}

impl From<CageMapSpec> for CageMap {
    fn from(map: CageMapSpec) -> Self {
        match map {
            CageMapSpec::Exact => Self::Exact,
            CageMapSpec::Frozen => Self::Frozen,
        }
    }
}
