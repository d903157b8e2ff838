//! A complete search of a sparse grid leaves out nothing either where its margin lies beyond the band, or where the sign of an open mesh
//! jumps there.

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::{
    BakeOptions, ContactOptions, Contacts, Elements, Field, GridSize, MeshClusters, MeshInMotion, MeshView,
};
use sdf_procedural::random::{Random, test_seed};
use sdf_procedural::{Mesh, SpikedBall};

/// Cells along the longest side of a body.
const CELLS: u32 = 40;

/// A ball whose corners lie at random distances from its middle.
fn rough_ball(random: &mut Random) -> Mesh {
    let mut mesh = SpikedBall { levels: 2, radius: 1.0 }.mesh();
    for point in &mut mesh.points {
        let stretch = random.between(0.5, 1.4);
        *point = point.map(|x| x * stretch);
    }
    mesh
}

fn cube(triangles: usize) -> Mesh {
    let corner = |index: usize| [0, 1, 2].map(|axis| if index >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let all = sides.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
    Mesh { points: (0..8).map(corner).collect(), triangles: all[..triangles].to_vec(), segments: vec![] }
}

/// A mesh in its grid, a cloud of small triangles around it, and the exact distances of their corners and of the lowest of each.
struct Scene {
    field: Field,
    spacing: f64,
    points: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    exact: Vec<f64>,
}

impl Scene {
    fn new(mesh: &Mesh, band: u32, random: &mut Random) -> Self {
        let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
        let options = BakeOptions {
            size: GridSize::Cells(CELLS),
            layout: Layout::Sparse,
            band,
            precision: Some(Precision::F32),
            ..BakeOptions::default()
        };
        let field = Field::bake(view, &options).unwrap().field;
        let grid = field.grid().unwrap();
        let (spacing, bounds) = (grid.lattice().spacing(), grid.lattice().bounds());
        let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
        let distance = MeshDistance::new(&triangles, None);
        let (mut points, mut faces) = (vec![], vec![]);
        for face in 0..4000 {
            let middle: [f64; 3] = std::array::from_fn(|axis| random.between(bounds.min[axis], bounds.max[axis]));
            for _ in 0..3 {
                let offset = random.point_in_cube(0.05 * spacing);
                points.push(std::array::from_fn(|axis| middle[axis] + offset[axis]));
            }
            faces.push([3 * face, 3 * face + 1, 3 * face + 2]);
        }
        let exact = points.iter().map(|point| distance.signed_distance(*point)).collect();
        Self { field, spacing, points, faces, exact }
    }

    fn view(&self) -> MeshView<'_> {
        MeshView { points: &self.points, faces: &self.faces }
    }

    /// Checks the contacts of all vertices or faces within the margin. Returns the number of elements within it by exact distances.
    fn check(&self, contacts: &Contacts, elements: Elements, margin: f64) -> usize {
        let exact = |element: usize| match elements {
            Elements::Faces => {
                self.faces[element].iter().map(|k| self.exact[*k as usize]).fold(f64::INFINITY, f64::min)
            }
            _ => self.exact[element],
        };
        let count = if elements == Elements::Faces { self.faces.len() } else { self.points.len() };
        let mut is_found = vec![false; count];
        for contact in &contacts.contacts {
            let element = contact.element as usize;
            is_found[element] = true;
            let slack = 1e-6;
            assert!(contact.shape_lower_bound <= exact(element) + slack, "{contact:?} at {}", exact(element));
            let is_point = elements == Elements::Vertices;
            let is_off = is_point && (contact.distance - exact(element)).abs() > contact.error_bound + slack;
            assert!(!is_off, "{contact:?} at {}", exact(element));
        }
        let near: Vec<usize> = (0..count).filter(|element| exact(*element) <= margin).collect();
        let missed = near.iter().find(|element| !is_found[**element]);
        assert_eq!(missed.map(|element| exact(*element)), None, "missed, margin {margin} of {} points", near.len());
        near.len()
    }

    /// Checks by vertices, by faces, and by faces in clusters.
    fn check_all(&self, margin: f64) -> usize {
        let complete = ContactOptions { margin, complete: true, ..ContactOptions::default() };
        let vertices = ContactOptions { elements: Elements::Vertices, ..complete };
        let found = self.check(&self.field.contacts(self.view(), &vertices).unwrap(), Elements::Vertices, margin);
        self.check(&self.field.contacts(self.view(), &complete).unwrap(), Elements::Faces, margin);
        let clusters = MeshClusters::new(self.view()).unwrap();
        let in_motion = MeshInMotion { clusters: Some(&clusters), ..MeshInMotion::new(self.view()) };
        self.check(&self.field.contacts_in_motion(&in_motion, &complete).unwrap(), Elements::Faces, margin);
        found
    }
}

#[test]
fn a_complete_search_with_a_margin_beyond_the_band_leaves_out_nothing() {
    let seed = test_seed(20_201_123);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let mut count = 0;
    for _ in 0..3 {
        let scene = Scene::new(&rough_ball(&mut random), 1, &mut random);
        for voxels in [-12.0, -9.0, -4.0, -1.5, 0.0, 1.2, 1.5, 2.0, 3.0] {
            count += scene.check_all(voxels * scene.spacing);
        }
    }
    let scene = Scene::new(&cube(12), 3, &mut random);
    for margin in [-0.9, -0.8, -0.3, 0.0, 0.2] {
        count += scene.check_all(margin);
    }
    assert!(count > 20_000, "{count} near points");
}

#[test]
fn where_the_sign_of_an_open_mesh_jumps_beyond_the_band_a_complete_search_leaves_out_nothing() {
    let seed = test_seed(20_201_124);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let scene = Scene::new(&cube(10), 3, &mut random);
    let count: usize = [-0.5, -0.1, 0.0, 0.1].map(|margin| scene.check_all(margin)).iter().sum();
    assert!(count > 10_000, "{count} near points");
}
