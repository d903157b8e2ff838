//! A sheet that begins inside of a body (Macklin et al. 2020, Fig. 8): by the body's field it gets out; by pairs of triangles, the
//! surface approach, it stays, as a pair pushes along the line between its nearest points, whichever side of the surface that is.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use sdf_field::{ContactOptions, Contacts, Field, MeshView, Method, QueryError, Threads};
use sdf_sim::scene::{self, Stage};
use sdf_sim::{Motion, Obstacle, Query};

use crate::V3;

/// The triangles of a body, without an inside.
struct Triangles {
    corners: Vec<[V3; 3]>,
}

/// A point of a triangle by its weights.
fn mix(corners: &[V3; 3], weights: [f64; 3]) -> V3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// Weights of the point of a triangle that is nearest to a point (Ericson 2005, "Real-Time Collision Detection", §5.1.5).
fn nearest(point: &V3, [a, b, c]: &[V3; 3]) -> [f64; 3] {
    let along = |from: &V3, to: &V3| {
        let way = to - from;
        ((point - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0)
    };
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2, d3, d4, d5) = (ab.dot(&ab), ab.dot(&ac), ac.dot(&ac), ap.dot(&ab), ap.dot(&ac));
    let scale = d1 * d3 - d2 * d2;
    let (v, w) = ((d3 * d4 - d2 * d5) / scale, (d1 * d5 - d2 * d4) / scale);
    if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
        return [1.0 - v - w, v, w];
    }
    let (s, t, u) = (along(a, b), along(b, c), along(c, a));
    let sides = [[1.0 - s, s, 0.0], [0.0, 1.0 - t, t], [u, 0.0, 1.0 - u]];
    let distance = |weights: &[f64; 3]| (mix(&[*a, *b, *c], *weights) - point).norm();
    sides.into_iter().min_by(|p, q| distance(p).total_cmp(&distance(q))).unwrap()
}

/// Weights of the nearest points of two triangles: a corner of one and a point of the other, or points of two sides.
fn nearest_pair(a: &[V3; 3], b: &[V3; 3]) -> [[f64; 3]; 2] {
    let corner = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
    let mut pairs: Vec<[[f64; 3]; 2]> = (0..3).map(|k| [corner(k), nearest(&a[k], b)]).collect();
    pairs.extend((0..3).map(|k| [nearest(&b[k], a), corner(k)]));
    // Of two sides by turns: each step is a projection, so it comes nearer.
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        let (p, q, r, s) = (a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]);
        let onto = |point: V3, from: V3, to: V3| {
            ((point - from).dot(&(to - from)) / (to - from).norm_squared()).clamp(0.0, 1.0)
        };
        let (mut u, mut v) = (0.5, 0.5);
        for _ in 0..8 {
            u = onto(r.lerp(&s, v), p, q);
            v = onto(p.lerp(&q, u), r, s);
        }
        let side = |k: usize, share: f64| {
            std::array::from_fn(|i| {
                if i == k {
                    1.0 - share
                } else if i == (k + 1) % 3 {
                    share
                } else {
                    0.0
                }
            })
        };
        pairs.push([side(i, u), side(j, v)]);
    }
    let distance = |[u, v]: &[[f64; 3]; 2]| (mix(a, *u) - mix(b, *v)).norm();
    pairs.into_iter().min_by(|p, q| distance(p).total_cmp(&distance(q))).unwrap()
}

impl Obstacle for Triangles {
    fn contacts(&self, mesh: MeshView, _: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        let mut found = Contacts::default();
        let boxed = |corners: &[V3; 3]| {
            let [a, b, c] = corners;
            [a.inf(b).inf(c), a.sup(b).sup(c)]
        };
        let boxes: Vec<[V3; 2]> = self.corners.iter().map(boxed).collect();
        for (element, vertices) in (0..).zip(mesh.faces) {
            let face = vertices.map(|vertex| V3::from(mesh.points[vertex as usize]));
            let [low, high] = boxed(&face);
            let is_near = |bounds: &[V3; 2]| {
                (0..3).all(|k| bounds[0][k] <= high[k] + options.margin && low[k] <= bounds[1][k] + options.margin)
            };
            for (other, _) in self.corners.iter().zip(&boxes).filter(|(_, bounds)| is_near(bounds)) {
                let [weights, of_other] = nearest_pair(&face, other);
                let (point, surface_point) = (mix(&face, weights), mix(other, of_other));
                let distance = (point - surface_point).norm();
                if distance > options.margin || distance == 0.0 {
                    continue;
                }
                found.contacts.push(Contact {
                    kind: ElementKind::Face,
                    element,
                    vertices: *vertices,
                    rank: 0,
                    feature: Feature::Face(element),
                    weights,
                    point,
                    surface_point,
                    normal: (point - surface_point) / distance,
                    slope: 1.0,
                    distance,
                    lower_bound: distance,
                    error_bound: 0.0,
                    shape_lower_bound: distance,
                    evaluations: 1,
                    status: ContactStatus::Converged,
                });
            }
        }
        Ok(found)
    }
}

/// Faces deep in the body at the start and after a unit of time, in one pose.
fn deep(seed: u64, by_triangles: bool) -> [usize; 2] {
    let text = include_str!("../../../scenes/11-entangled.toml");
    let mut spec = scene::parse(text, "11-entangled").unwrap();
    (spec.seed, spec.substeps) = (seed, 4);
    spec.shrink();
    spec.frames = 60;
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let body = sdf_procedural::Serpent { rings: 48, slices: 16, spine: 0.2, every: 6 }.mesh();
    let corners = body.triangles.iter().map(|face| face.map(|vertex| V3::from(body.points[vertex as usize]))).collect();
    let triangles = Triangles { corners };
    let field: Field = stage.obstacles[0].clone();
    let count = |stage: &Stage| {
        let truth = Query { one_per_feature: false, method: Method::Certified, ..Query::default() };
        let mut found = sdf_sim::Contacts::default();
        truth.find(&field, &stage.surfaces[0], &stage.world, &Motion::NONE, &mut found).unwrap();
        found.contacts.iter().filter(|contact| contact.distance < -0.25 * spec.thickness).count()
    };
    let before = count(&stage);
    if by_triangles {
        let query = Query { thickness: spec.thickness, friction: 0.0, one_per_feature: false, ..Query::default() };
        let mut contacts = sdf_sim::Contacts::default();
        for _ in 0..spec.frames {
            let motion = Motion::of(&stage.world, 1.0 / spec.rate);
            contacts.clear();
            query.find(&triangles, &stage.surfaces[0], &stage.world, &motion, &mut contacts).unwrap();
            for _ in 0..spec.substeps {
                stage.world.step(1.0 / (spec.rate * f64::from(spec.substeps)), contacts.rows());
            }
        }
    } else {
        let each = |_: u32, _: &Stage| std::ops::ControlFlow::Continue(());
        scene::run(&spec, &mut stage, "fw".parse().unwrap(), Threads::ONE, each).unwrap();
    }
    [before, count(&stage)]
}

#[test]
fn an_entangled_sheet_leaves_by_the_field_and_stays_by_pairs_of_triangles() {
    let seeds = [0, 1, 2];
    let [by_field, by_triangles] = [false, true].map(|by_triangles| seeds.map(|seed| deep(seed, by_triangles)));
    println!("deep before and after: field {by_field:?}, triangles {by_triangles:?}");
    assert!(by_field.iter().filter(|[before, after]| *before > 10 && *after == 0).count() >= 2, "{by_field:?}");
    assert!(by_triangles.iter().all(|[before, after]| *before > 10 && 3 * after > *before), "{by_triangles:?}");
}

/// A body has an inside, and leaves whole: sides are chosen for sheets alone.
#[test]
fn a_box_that_falls_on_a_floor_moves_the_same_where_sheets_choose_a_side() {
    let place = |choose_side: bool| {
        let text = format!(
            "title = \"a box\"\nframes = 60\nchoose_side = {choose_side}\n\
             [[rigid]]\nmesh.cuboid = {{ half = [0.1, 0.2, 0.15] }}\nstart = {{ translate = [0.0, 0.0, 0.5], turn = [20.0, 35.0, 0.0] }}\n\
             [[obstacle]]\nshape = 'field = {{ shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = 0.0 }}'\n"
        );
        let spec = scene::parse(&text, "my.toml").unwrap();
        let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
        scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, _| ControlFlow::Continue(())).unwrap();
        stage.world.bodies[0].position
    };
    assert_eq!(place(true), place(false));
}
