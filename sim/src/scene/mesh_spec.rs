//! Meshes of a scene file: by formula, or from a file.

use std::path::{Path, PathBuf};

use sdf_procedural::{Bowl, Cuboid, Mesh, Pot, Rope, Serpent, Sheet, SpikedBall};
use serde::Deserialize;

/// A mesh by formula, or a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MeshSpec {
    /// A cloth or net over the origin.
    Sheet(Sheet),
    /// A ball with spikes.
    SpikedBall(SpikedBall),
    /// A long winding body with spines.
    Serpent(Serpent),
    /// Half of a hollow ball.
    Bowl(Bowl),
    /// A pot with a spout.
    Pot(Pot),
    /// A box.
    Cuboid(Cuboid),
    /// Strings.
    Rope(Rope),
    /// An OBJ, PLY, STL or OFF file, beside the scene's own.
    File(PathBuf),
}

/// A file beside the scene's own. Devices and pipes are refused: they may have no end.
pub(super) fn regular_file(folder: &Path, path: &Path) -> Result<PathBuf, String> {
    let path = folder.join(path);
    match std::fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => Ok(path),
        Ok(_) => Err(format!("{}: is not a regular file: name one beside the scene's file", path.display())),
        Err(error) => Err(format!("{}: {error}", path.display())),
    }
}

/// Most points of a mesh by formula.
const MAX_POINTS: f64 = 1e7;

impl MeshSpec {
    /// The mesh; files are looked for in `folder`.
    pub(super) fn mesh(&self, folder: &Path) -> Result<Mesh, String> {
        // Meshes by formula have more points than cells: an end on each line, and at least four lines around.
        let count = |rows: u32, columns: u32| (f64::from(rows) + 4.0) * (f64::from(columns) + 4.0);
        let points = match self {
            Self::Sheet(sheet) => count(sheet.cells[0], sheet.cells[1]),
            Self::SpikedBall(ball) => 20.0 * 4_f64.powf(f64::from(ball.levels)),
            Self::Serpent(serpent) => count(serpent.rings, serpent.slices),
            Self::Bowl(bowl) => count(bowl.slices, bowl.stacks),
            Self::Pot(pot) => 2.0 * count(pot.slices, pot.stacks),
            Self::Rope(rope) => count(rope.strands, rope.edges),
            Self::Cuboid(_) | Self::File(_) => 0.0,
        };
        if points > MAX_POINTS {
            return Err(format!("a mesh of about {points:.0} points: take less than {MAX_POINTS:.0}"));
        }
        Ok(match self {
            Self::Sheet(sheet) => sheet.mesh(),
            Self::SpikedBall(ball) => ball.mesh(),
            Self::Serpent(serpent) => serpent.mesh(),
            Self::Bowl(bowl) => bowl.mesh(),
            Self::Pot(pot) => pot.mesh(),
            Self::Cuboid(cuboid) => cuboid.mesh(),
            Self::Rope(rope) => rope.mesh(),
            Self::File(path) => {
                let path = regular_file(folder, path)?;
                let mesh = sdf_formats::mesh::read(&path).map_err(|error| error.to_string())?;
                Mesh { points: mesh.points, triangles: mesh.triangles, segments: mesh.segments }
            }
        })
    }
}

/// For each point the first one at the same place; 0 and −0 are one.
fn first_at_place(points: &[[f64; 3]]) -> Vec<u32> {
    let place = |index: &u32| points[*index as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|index| (place(index), *index));
    let mut first = vec![0; order.len()];
    for same in order.chunk_by(|a, b| place(a) == place(b)) {
        same.iter().for_each(|index| first[*index as usize] = same[0]);
    }
    first
}

/// Makes one of the points at each place, the first of them. Returns for each point the one that it is now.
pub(super) fn weld(mesh: &mut Mesh) -> Vec<u32> {
    let (mut points, mut welded) = (vec![], vec![]);
    for (index, first) in (0..).zip(first_at_place(&mesh.points)) {
        if first == index {
            welded.push(points.len() as u32);
            points.push(mesh.points[index as usize]);
        } else {
            welded.push(welded[first as usize]);
        }
    }
    mesh.points = points;
    mesh.triangles.as_flattened_mut().iter_mut().for_each(|vertex| *vertex = welded[*vertex as usize]);
    welded
}

/// Edges where a surface ends: how many there are, and both ends of one. `None` of a closed mesh. Points at the same place are one.
pub(super) fn open_edges(mesh: &Mesh) -> Option<(usize, [[f64; 3]; 2])> {
    let joined = first_at_place(&mesh.points);
    // Each edge from its lower to its higher point, and whether a triangle goes that way.
    let ways = mesh.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).filter_map(|ends| {
        let [from, to] = ends.map(|end| joined[*end as usize]);
        (from != to).then_some(([from.min(to), from.max(to)], from < to))
    });
    let mut ways: Vec<_> = ways.collect();
    ways.sort_unstable();
    let is_open = |way: &&[([u32; 2], bool)]| 2 * way.iter().filter(|(_, is_up)| *is_up).count() != way.len();
    let mut open = ways.chunk_by(|a, b| a.0 == b.0).filter(is_open).map(|way| way[0].0);
    let first = open.next()?;
    Some((1 + open.count(), first.map(|end| mesh.points[end as usize])))
}
