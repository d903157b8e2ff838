//! A smaller scene: which counts are halved, and which vertices are then held?

use std::path::Path;

use super::mesh_spec::MeshSpec;
use super::spec::{ClothSpec, SceneSpec};
use crate::V3;

impl SceneSpec {
    /// About an eighth of the work: half of the frames, of the cells of sheets, bowls and ropes along each side, and of those of the
    /// grids of obstacles. Other meshes and the grids of bodies stay: fewer cells would make other bodies of them. Pins go to the
    /// nearest vertices.
    pub fn shrink(&mut self) {
        self.frames = self.frames.div_ceil(2);
        self.cloth.iter_mut().for_each(shrink_cloth);
        self.rigid.iter_mut().for_each(|rigid| halve(&mut rigid.mesh));
        self.obstacle.iter_mut().for_each(|obstacle| {
            obstacle.cells = obstacle.mesh.as_ref().map(|_| obstacle.grid_cells().div_ceil(2));
        });
    }
}

fn halve(mesh: &mut MeshSpec) {
    match mesh {
        MeshSpec::Sheet(sheet) => {
            sheet.cells = sheet.cells.map(|cells| cells.div_ceil(2));
            sheet.faces = sheet.faces.map(|faces| faces.div_ceil(4));
        }
        // No ring has fewer than three points.
        MeshSpec::Bowl(bowl) => {
            (bowl.slices, bowl.stacks) = (bowl.slices.div_ceil(2).max(3), bowl.stacks.div_ceil(2).max(3));
        }
        MeshSpec::Rope(rope) => (rope.strands, rope.edges) = (rope.strands.div_ceil(2), rope.edges.div_ceil(2)),
        _ => {}
    }
}

fn shrink_cloth(cloth: &mut ClothSpec) {
    let before = cloth.mesh.clone();
    halve(&mut cloth.mesh);
    if cloth.pins.is_empty() || matches!(before, MeshSpec::File(_)) {
        return;
    }
    // A mesh that is too large is refused when it is built.
    let [Ok(before), Ok(after)] = [&before, &cloth.mesh].map(|mesh| mesh.mesh(Path::new(""))) else { return };
    for pin in &mut cloth.pins {
        // One that is not there stays so: the smaller mesh has no such vertex either.
        let Some(place) = before.points.get(*pin as usize) else { continue };
        let distance_sq = |point: &[f64; 3]| (V3::from(*point) - V3::from(*place)).norm_squared();
        let nearest = (0..).zip(&after.points).min_by(|(_, a), (_, b)| distance_sq(a).total_cmp(&distance_sq(b)));
        *pin = nearest.map_or(*pin, |(index, _)| index);
    }
}
