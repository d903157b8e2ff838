//! Clusters of elements: contacts of what they leave are the contacts of the whole mesh, bit for bit.

use nalgebra::Vector3;
use sdf_core::contact::{CLUSTER_SIZE, ClusterKey, Clusters, Element, Outcome, cluster_count, contact, refit};
use sdf_core::minimize::FrankWolfe;
use sdf_core::placed::Rigid;
use sdf_core::{Aabb, EnclosedSdf, Float, Real, Simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;

use crate::random_pose;

/// Small faces along a random walk, so that neighbours are near and some clusters far.
fn faces(random: &mut Random, count: usize, size: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut points: Vec<[f64; 3]> = vec![];
    let mut at = random.in_cube(size);
    for _ in 0..count + 2 {
        at += random.in_cube(0.12 * size);
        at = at.map(|x| x.clamp(-2.5 * size, 2.5 * size));
        points.push(at.into());
    }
    let mut faces: Vec<_> = (0..count as u32).map(|k| [k, k + 1, k + 2]).collect();
    random.shuffle(&mut faces);
    (points, faces)
}

struct Owned {
    order: Vec<u32>,
    boxes: Vec<Aabb>,
}

fn build<R: Float, const N: usize>(points: &[[R; 3]], elements: &[[u32; N]]) -> Owned {
    let count = elements.len();
    let (mut order, mut boxes) = (vec![0; count], vec![Aabb::EVERYWHERE; cluster_count(count)]);
    let mut scratch = vec![ClusterKey::default(); count];
    Clusters::build(points, elements, &mut scratch, &mut order, &mut boxes).unwrap();
    Owned { order, boxes }
}

fn element<R: Float>(points: &[[f64; 3]], faces: &[[u32; 3]], id: u32, pose: Option<&Rigid>) -> Element<R, 3> {
    let vertices = faces[id as usize];
    let corners = vertices.map(|vertex| {
        let local = Vector3::from(points[vertex as usize]);
        pose.map_or(local, |pose| pose.push(local)).map(<R as Real>::from_f64)
    });
    Element { id, vertices, simplex: Simplex { corners } }
}

/// Faces of a mesh in clusters, in a pose.
pub struct Faces {
    points: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    pose: Option<Rigid>,
    owned: Owned,
}

impl Faces {
    pub fn new(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>, pose: Option<Rigid>) -> Self {
        let owned = build(&points, &faces);
        Self { points, faces, pose, owned }
    }

    pub fn count(&self) -> usize {
        self.faces.len()
    }

    pub fn elements(&self) -> impl Iterator<Item = Element<f64, 3>> {
        (0..self.faces.len() as u32).map(|id| element(&self.points, &self.faces, id, self.pose.as_ref()))
    }

    /// The faces that the clusters leave.
    pub fn near(&self, field: &impl EnclosedSdf, margin: f64) -> Vec<u32> {
        let clusters = Clusters::from_parts(&self.owned.order, &self.owned.boxes).unwrap();
        let mut near = vec![];
        clusters.visit_near(field, margin, self.pose.as_ref(), |members| near.extend_from_slice(members));
        near
    }
}

/// Returns how many elements the clusters leave.
fn check<R: Float, F: EnclosedSdf>(
    name: &str,
    field: &F,
    margin: f64,
    (points, faces): (&[[f64; 3]], &[[u32; 3]]),
    pose: Option<&Rigid>,
) -> usize {
    let owned = build(points, faces);
    let clusters = Clusters::from_parts(&owned.order, &owned.boxes).unwrap();
    let mut is_near = vec![false; faces.len()];
    let margin = <R as Real>::from_f64(margin);
    clusters.visit_near(field, margin, pose, |members| members.iter().for_each(|id| is_near[*id as usize] = true));
    for (id, _) in (0..).zip(faces).filter(|(id, _)| !is_near[*id as usize]) {
        let outcome = contact(field, &FrankWolfe::default(), margin, &element::<R>(points, faces, id, pose));
        assert!(!matches!(outcome, Outcome::Contact(_) | Outcome::NotFinite), "{name}: {id} was left out, {outcome:?}");
    }
    is_near.iter().filter(|near| **near).count()
}

#[test]
fn no_contact_is_left_out_by_clusters() {
    let mut random = Random::seeded();
    let (mut left, mut all) = (0, 0);
    for scene in scenes(1.0) {
        let (points, faces) = faces(&mut random, 700, scene.size);
        let margin = scene.size * random.pick(&[-0.1, 0.0, 0.05]);
        let pose = random_pose(&mut random, scene.size);
        let mesh = (&points[..], &faces[..]);
        left += check::<f64, _>(scene.name, &scene.field, margin, mesh, None);
        left += check::<f64, _>(scene.name, &scene.field, margin, mesh, Some(&pose));
        left += check::<f32, _>(scene.name, &scene.field, margin, mesh, Some(&pose));
        all += 3 * faces.len();
    }
    assert!(4 * left < 3 * all, "{left} of {all} are left: the clusters cull too little to be tested");
}

#[test]
fn an_order_has_every_element_once_and_its_boxes_hold_them() {
    let mut random = Random::seeded();
    for count in [0, 1, 63, 64, 65, 1000] {
        let (points, faces) = faces(&mut random, count, 1.0);
        let Owned { order, boxes } = build(&points, &faces);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..count as u32));
        for (members, bounds) in order.chunks(CLUSTER_SIZE).zip(&boxes) {
            for corner in members.iter().flat_map(|id| faces[*id as usize]) {
                assert!(bounds.encloses(&Aabb { min: points[corner as usize], max: points[corner as usize] }));
            }
        }
        let total = |boxes: &[Aabb]| boxes.iter().map(|bounds| bounds.diagonal()).sum::<f64>();
        let unsorted: Vec<u32> = (0..count as u32).collect();
        let mut loose = boxes.clone();
        assert!(refit(&points, &faces, &unsorted, &mut loose));
        assert!(count < 1000 || total(&boxes) < 0.7 * total(&loose), "{} of {}", total(&boxes), total(&loose));
    }
}

#[test]
fn clusters_with_points_that_are_not_finite_are_always_visited() {
    let mut random = Random::seeded();
    let (mut points, faces) = faces(&mut random, 400, 1.0);
    points.iter_mut().for_each(|point| point[0] += 1000.0);
    let ball = sdf_core::shapes::Sphere::new(1.0).unwrap();
    assert_eq!(check::<f64, _>("ball", &ball, 0.1, (&points, &faces), None), 0);
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        points[200][1] = bad;
        let near = check::<f64, _>("ball", &ball, 0.1, (&points, &faces), None);
        assert!((3..=192).contains(&near), "{near}");
    }
}

#[test]
fn buffers_that_do_not_match_and_vertices_that_are_missing_are_refused() {
    let points = [[0.0; 3]; 3];
    let (mut order, mut boxes, mut scratch) = ([0], [Aabb::EVERYWHERE], [ClusterKey::default()]);
    assert_eq!(Clusters::build(&points, &[[0, 1, 3]], &mut scratch, &mut order, &mut boxes), None);
    assert_eq!(Clusters::build(&points, &[[0, 1, 2]], &mut [], &mut order, &mut boxes), None);
    assert_eq!(Clusters::build(&points, &[[0, 1, 2]], &mut scratch, &mut [0; 2], &mut boxes), None);
    assert_eq!(Clusters::build(&points, &[[0, 1, 2]], &mut scratch, &mut order, &mut []), None);
    assert!(Clusters::build(&points, &[[0, 1, 2]], &mut scratch, &mut order, &mut boxes).is_some());
    assert_eq!(Clusters::from_parts(&[0; 65], &boxes), None);
    assert!(!refit(&points, &[[0, 1, 9]], &[0], &mut boxes));
    assert!(!refit(&points, &[[0, 1, 2]], &[1], &mut boxes));
}
