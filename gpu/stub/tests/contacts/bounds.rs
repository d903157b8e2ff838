//! Bounds of points far from the origin: do they hold on the points as they were given, where rounding to f32 moves them by more than
//! the search allows for?

use std::path::Path;

use sdf_core::contact::Contact;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};
use sdf_field::cuda::{Cuda, CudaFaces, CudaMesh, CudaPoints, CudaQuery};
use sdf_field::{ContactOptions, Elements, Field, Method, Threads};
use sdf_gpu::Ready;

use crate::lent::Other;
use crate::scenes::{Scene, scene};
use crate::with_stub;

/// A body that stands where f32 has steps of 2.4e-4.
fn far() -> Rigid {
    Rigid::new([1000.0, 0.0, -3000.0], [0.0, 0.3, 1.0, 0.1]).unwrap()
}

/// The points that touch, each with its φ in f64: the one value of its element, which no lower bound may exceed.
fn touching(query: &mut CudaQuery, field: &Field, points: &[[f64; 3]]) -> Vec<f64> {
    let found = query.contacts().unwrap().contacts;
    let at = |vertex: u32| far().pull(Vector3::from(points[vertex as usize])).point.into();
    let touching: Vec<[f64; 3]> = found.iter().map(|contact| at(contact.vertices[0])).collect();
    let values = field.values(&touching, Threads::ONE);
    assert!(found.len() > 50, "{}", found.len());
    for (contact, value) in found.iter().zip(&values) {
        assert!(contact.lower_bound <= *value, "{contact:?}, φ {value}");
        assert!(contact.shape_lower_bound <= contact.lower_bound, "{contact:?}");
    }
    found.iter().zip(&values).map(|(contact, value)| contact.distance - value).collect()
}

/// Calls `test` with each kind of field, and what to ask of it where it stands far away.
fn for_each_kind(folder: &Path, test: impl Fn(&str, &Cuda, &Scene, &Field, &ContactOptions)) {
    let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
    for kind in ["dense", "sparse_u16", "shapes"] {
        let scene = scene(kind);
        let field = Field::new(scene.field.clone());
        let margin = f64::from(scene.margin);
        let options = ContactOptions { margin, pose: Some(far()), elements: Elements::Vertices, ..Default::default() };
        test(kind, &cuda, &scene, &field, &options);
    }
}

/// The other ends of edges are so far away that rounding moves the ends near the body's surface, too.
#[test]
fn bounds_hold_on_points_that_f32_moves_farther_than_the_search_allows_for() {
    with_stub("bounds::bounds_hold_on_points_that_f32_moves_farther_than_the_search_allows_for", &[], |folder| {
        for_each_kind(folder, |kind, cuda, scene, field, options| {
            let options = ContactOptions { pose: None, method: Method::FrankWolfe, ..*options };
            let near = scene.points.iter().map(|point| Vector3::from(*point).map(f64::from));
            let near: Vec<_> = near.filter(|point| point.iter().all(|x| x.is_finite())).collect();
            // An end 10⁵ away to each side, with the point at a third of the way.
            let way = |point: &Vector3<f64>| point.yzx().normalize() * 1e5;
            let ends = near.iter().flat_map(|point| [point - way(point), point + way(point) * 2.0]);
            let points: Vec<[f64; 3]> = ends.map(Into::into).collect();
            let edges: Vec<[u32; 2]> = (0..near.len() as u32).map(|edge| [2 * edge, 2 * edge + 1]).collect();
            let found = field.query_edges_on(cuda, &points, &edges, &options).unwrap().contacts().unwrap().contacts;
            assert!(found.len() > 50, "{}", found.len());
            let end = |contact: &Contact<f64>, end: usize| Vector3::from(points[contact.vertices[end] as usize]);
            let at = |contact: &Contact<f64>| {
                let [first, second] = [0, 1].map(|index| end(contact, index) * contact.weights[index]);
                (first + second).into()
            };
            let touching: Vec<[f64; 3]> = found.iter().map(at).collect();
            let values = field.values(&touching, Threads::ONE);
            let mut off = 0.0_f64;
            for (contact, value) in found.iter().zip(&values) {
                assert!(contact.lower_bound <= *value, "{kind}: {contact:?}, φ {value}");
                assert!(contact.shape_lower_bound <= contact.lower_bound, "{kind}: {contact:?}");
                off = off.max(contact.distance - value);
            }
            // The search allows for 32 units of 1.2e-7 times the coordinates near the body, of 2.4 at most: 9e-6.
            assert!(off > 3e-5, "{kind}: φ is off by {off} at most");
        });
    });
}

#[test]
fn bounds_hold_on_points_that_the_card_alone_has() {
    with_stub("bounds::bounds_hold_on_points_that_the_card_alone_has", &[], |folder| {
        for_each_kind(folder, |kind, cuda, scene, field, options| {
            let place = |point: &[f32; 3]| far().push(Vector3::from(*point).map(f64::from)).map(|x| x as f32).into();
            let on_card: Vec<[f32; 3]> = scene.points.iter().map(place).collect();
            let points: Vec<[f64; 3]> = on_card.iter().map(|point| point.map(f64::from)).collect();
            let other = Other::new(on_card.as_flattened());
            let lent = CudaPoints::Lent(other.lend(cuda.gpu(), Ready::AfterAll));
            let mesh = CudaMesh { points: lent, faces: CudaFaces::Slice(&[]) };
            let mut query = field.query_on(cuda, mesh, options).unwrap();
            // They are rounded once, at the size of the coordinates in the body's frame.
            let off = touching(&mut query, field, &points).into_iter().fold(0.0, f64::max);
            assert!(off < 1e-6, "{kind}: φ is off by {off}");
        });
    });
}
