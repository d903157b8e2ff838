//! How much can all bodies of a scene hold together, copies and all?

use sdf_procedural::Mesh;

/// Most points of all meshes that move.
const MAX_POINTS: usize = 10_000_000;

/// Most triangles and lines of all meshes that move.
const MAX_ELEMENTS: usize = 20_000_000;

/// Most bodies: each may meet every other.
const MAX_BODIES: usize = 10_000;

/// Most cubes in the boxes around all soft bodies.
const MAX_CUBES: f64 = 1e6;

/// Sums over the bodies so far, so that a mistyped number, or many tables, end in a message and not in all of the memory.
#[derive(Default)]
pub(super) struct Budget {
    points: usize,
    elements: usize,
    bodies: usize,
    cubes: f64,
}

impl Budget {
    /// Counts a mesh `copies` times. `name` says whose it is.
    pub(super) fn add(&mut self, name: &str, mesh: &Mesh, copies: usize) -> Result<(), String> {
        let (points, elements) = (mesh.points.len(), mesh.triangles.len() + mesh.segments.len());
        let add = |so_far: &mut usize, count: usize| *so_far = so_far.saturating_add(count.saturating_mul(copies));
        add(&mut self.points, points);
        add(&mut self.elements, elements);
        add(&mut self.bodies, 1);
        if self.points <= MAX_POINTS && self.elements <= MAX_ELEMENTS {
            return match self.bodies <= MAX_BODIES {
                true => Ok(()),
                false => Err(format!("{name}: {} bodies together: take at most {MAX_BODIES}", self.bodies)),
            };
        }
        let times = if copies > 1 { format!("{copies} times ") } else { String::new() };
        Err(format!(
            "{name}: {times}{points} points and {elements} triangles or lines, of all bodies together {} and {}: \
             take coarser meshes or fewer of them, for at most {MAX_POINTS} and {MAX_ELEMENTS}",
            self.points, self.elements
        ))
    }

    /// Counts the cubes of a box around a soft body.
    pub(super) fn add_cubes(&mut self, name: &str, cubes: f64) -> Result<(), String> {
        self.cubes += cubes;
        if self.cubes <= MAX_CUBES {
            return Ok(());
        }
        Err(format!(
            "{name}: a box of {cubes:.0} cubes around it, of all soft bodies together {:.0}: \
             use a larger cell or fewer bodies, for at most {MAX_CUBES:.0}",
            self.cubes
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bodies_of_all_tables_count_together() {
        let point_mesh = Mesh { points: vec![[0.0; 3]; 8000], triangles: vec![], segments: vec![] };
        let face_mesh = Mesh { points: vec![], triangles: vec![[0; 3]; 12_000], segments: vec![[0; 2]; 8000] };
        let small_mesh = Mesh { points: vec![[0.0; 3]; 8], triangles: vec![[0; 3]; 12], segments: vec![] };
        let cases = [(point_mesh, MAX_POINTS / 8000), (face_mesh, MAX_ELEMENTS / 20_000), (small_mesh, MAX_BODIES)];
        for (mesh, most) in cases {
            let mut budget = Budget::default();
            assert_eq!(budget.add("rigid 1", &mesh, most - 1), Ok(()));
            assert_eq!(budget.add("cloth 1", &mesh, 1), Ok(()));
            let refused = budget.add("rigid 2", &mesh, 1).unwrap_err();
            assert!(refused.starts_with("rigid 2: ") && refused.contains("together"), "{refused}");
            assert!(Budget::default().add("rigid 1", &mesh, usize::MAX).is_err());
        }
    }

    #[test]
    fn the_cubes_of_all_soft_bodies_count_together() {
        let mut budget = Budget::default();
        assert_eq!(budget.add_cubes("soft 1", 0.6 * MAX_CUBES), Ok(()));
        let refused = budget.add_cubes("soft 2", 0.6 * MAX_CUBES).unwrap_err();
        assert!(refused.starts_with("soft 2: a box of 600000 cubes") && refused.contains("1200000"), "{refused}");
    }
}
