//! A rigid surface that is asked frame after frame: nothing that a search anew finds is missing, however the surface moves, and what is
//! at rest is not searched.

use sdf_core::contact::{Contact, ElementKind};
use sdf_core::nalgebra::{Isometry3, UnitQuaternion};
use sdf_core::placed::Rigid;
use sdf_core::shapes::Torus;
use sdf_field::{BakeOptions, Field, GridSize, MeshView};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};
use sdf_sim::{Body, Carrier, Contacts, Elements, Memory, Motion, Placed, Query, Surface, World};

use crate::V3;

const HOLD: f64 = 0.0005;
const THICKNESS: f64 = 0.01;

/// A body of 1,280 faces, whose spines and dents make many minima, and a field about as large.
struct Case {
    world: World,
    surface: Surface,
    field: Field,
    pose: Rigid,
}

impl Case {
    fn new(field: Field, pose: Rigid) -> Self {
        let ball = SpikedBall { levels: 3, radius: 0.5 }.mesh();
        let (body, points) = Body::of_mesh(&ball.points, &ball.triangles, 1.0).unwrap();
        let mut world = World::default();
        let id = world.add_body(body);
        let surface = Surface::of_faces(ball.triangles, points.len(), Carrier::Body { id, points });
        Self { world, surface, field, pose }
    }

    fn find(&self, query: &Query, motion: &Motion, memory: &mut Memory) -> Contacts {
        let obstacle = Placed { field: &self.field, pose: self.pose };
        let mut contacts = Contacts::default();
        query.find_again(&obstacle, &self.surface, &self.world, motion, memory, &mut contacts).unwrap();
        contacts
    }

    /// Moves the body by so much about one of the points where it touches, or about its middle.
    fn shift(&mut self, random: &mut Random, way: f64, touched: &[Contact<f64>]) {
        let mut direction = |half: f64| V3::from(random.point_in_cube(half));
        let (turn, step) = (UnitQuaternion::from_scaled_axis(direction(4.0 * way)), direction(way));
        let body = &mut self.world.bodies[0];
        let about = touched.first().map_or(body.position, |contact| contact.point);
        let moved = Isometry3::from_parts(body.position.into(), body.rotation);
        let turned = Isometry3::from_parts((about - turn * about + 0.2 * step).into(), turn) * moved;
        (body.position, body.rotation) = (turned.translation.vector, turned.rotation);
    }
}

/// Does a contact speak for the element of another, no farther off than that by more than a kept plane may be?
fn speaks_for(kept: &Contact<f64>, other: &Contact<f64>, slope_bound: f64) -> bool {
    let is_same = match kept.kind {
        ElementKind::Vertex => other.corner_vertices().contains(&kept.vertices[0]),
        kind => kind == other.kind && kept.element == other.element,
    };
    // Its corners and its vertex's have each moved by at most `HOLD` since they were searched, and its plane tells of no more.
    is_same && kept.distance <= other.distance + (1.0 + 3.0 * slope_bound) * HOLD
}

fn check(mut case: Case, elements: Elements, random: &mut Random) {
    let query = Query { elements, thickness: THICKNESS, hold: HOLD, one_per_feature: false, ..Query::default() };
    let slope_bound = case.field.slope_bound();
    let mut memory = Memory::default();
    let (mut compared, mut searched, mut searched_anew) = (0, 0, 0);
    for frame in 0..120 {
        // How far everything may get until the next search: another margin in each frame.
        let fall = if frame % 3 == 0 { random.between(0.0, 0.03) } else { 0.002 };
        let motion = Motion { fall, max: f64::INFINITY, ..Motion::NONE };
        let kept = case.find(&query, &motion, &mut memory);
        let anew = case.find(&query, &motion, &mut Memory::default());
        let needed = THICKNESS + fall;
        assert!(kept.contacts.iter().all(|contact| contact.distance <= needed));
        for contact in &anew.contacts {
            // A kept plane may tell of a little more than the margin.
            if contact.distance <= needed - (1.0 + 3.0 * slope_bound) * HOLD {
                let speaks = |kept: &&Contact<f64>| speaks_for(kept, contact, slope_bound);
                assert!(kept.contacts.iter().any(|kept| speaks(&kept)), "frame {frame}: {contact:?} is missing");
                compared += 1;
            }
        }
        searched += kept.searched_count;
        searched_anew += anew.searched_count;
        let again = case.find(&query, &motion, &mut memory);
        assert_eq!(again.contacts, kept.contacts, "nothing has moved");
        assert_eq!(again.searched_count, 0, "nothing has moved");
        let way = HOLD * random.pick(&[0.02, 0.1, 0.4, 1.0, 3.0]) * if frame % 40 == 39 { 30.0 } else { 1.0 };
        case.shift(random, way, &anew.contacts);
    }
    println!("{compared} compared, {searched} searched, {searched_anew} anew");
    assert!(compared > 5000 && 2 * searched < searched_anew, "{compared}, {searched} of {searched_anew}");
}

#[test]
fn a_rigid_surface_that_is_remembered_misses_nothing_that_a_search_anew_finds() {
    let mut random = Random::new(test_seed(6));
    let pose = |x: f64| Rigid::new([x, 0.2, -0.1], [0.1, 0.3, -0.2, 0.9]).unwrap();
    let ball = SpikedBall { levels: 3, radius: 0.6 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(32), ..BakeOptions::default() };
    let baked = Field::bake(MeshView { points: &ball.points, faces: &ball.triangles }, &options).unwrap().field;
    let vertices = Elements { faces: true, edges: false, vertices: true };
    let all = Elements { edges: true, ..vertices };
    check(Case::new(baked.clone(), pose(1.0)), vertices, &mut random);
    check(Case::new(baked, pose(1.0)), Elements::FACES, &mut random);
    check(Case::new(Field::new(Torus::new(0.7, 0.2).unwrap()), pose(1.2)), all, &mut random);
}
