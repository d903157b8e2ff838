//! A rigid surface that is searched in every frame with its memory: it has every contact that a search without memory finds, however
//! the surface moves, and elements at rest are not searched.

use sdf_core::contact::Contact;
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
        let surface = Surface::of_faces(ball.triangles, points.len(), Carrier::Body { id, points: points.into() });
        Self { world, surface, field, pose }
    }

    fn find(&self, query: &Query, motion: &Motion, memory: &mut Memory) -> Contacts {
        let obstacle = Placed { field: &self.field, pose: self.pose };
        let mut contacts = Contacts::default();
        query.find_again(&obstacle, &self.surface, &self.world, motion, memory, &mut contacts).unwrap();
        contacts
    }

    /// Turns the body about one of the points where it touches or about its middle, and moves it a little.
    fn shift(&mut self, random: &mut Random, way: f64, touched: &[Contact<f64>]) {
        let mut direction = |half: f64| V3::from(random.point_in_cube(half));
        let (turn, step) = (UnitQuaternion::from_scaled_axis(direction(4.0 * way)), direction(way));
        let is_rocking = random.below(2) == 0;
        let body = &mut self.world.bodies[0];
        let about = touched.first().filter(|_| is_rocking).map_or(body.position, |contact| contact.point);
        let moved = Isometry3::from_parts(body.position.into(), body.rotation);
        let turned = Isometry3::from_parts((about - turn * about + 0.2 * step).into(), turn) * moved;
        (body.position, body.rotation) = (turned.translation.vector, turned.rotation);
    }
}

/// Does a contact speak for the element of another, no farther off than that by more than a plane may be that is kept for a way of `hold`?
fn speaks_for(kept: &Contact<f64>, other: &Contact<f64>, slope_bound: f64, hold: f64) -> bool {
    let is_part = kept.corner_vertices().iter().all(|vertex| other.corner_vertices().contains(vertex));
    // The element and the part of it that speaks have each moved by at most `hold` since they were searched.
    is_part && kept.distance <= other.distance + (1.0 + 3.0 * slope_bound) * hold + 1e-12
}

fn check(mut case: Case, elements: Elements, hold: f64, random: &mut Random) {
    let query = Query { elements, thickness: THICKNESS, hold, one_per_feature: false, ..Query::default() };
    let slope_bound = case.field.slope_bound();
    let mut memory = Memory::default();
    let (center, direction) = (V3::from(case.pose.translation()), V3::from(random.point_in_cube(1.0)).normalize());
    let (mut compared, mut searched, mut searched_anew) = (0, 0, 0);
    for frame in 0..120 {
        // How far everything may get until the next search: another margin in each frame.
        let is_straight = (20..80).contains(&frame);
        let fall = if frame % 3 == 0 && !is_straight { random.between(0.0, 0.03) } else { 0.002 };
        let motion = Motion { fall, max: f64::INFINITY, ..Motion::NONE };
        let kept = case.find(&query, &motion, &mut memory);
        let anew = case.find(&query, &motion, &mut Memory::default());
        let needed = THICKNESS + fall;
        assert!(kept.contacts.iter().all(|contact| contact.distance <= needed));
        let mut elements: Vec<_> = kept.contacts.iter().map(|contact| (contact.kind, contact.element)).collect();
        elements.sort_unstable();
        assert!(elements.windows(2).all(|pair| pair[0] != pair[1]), "an element has two contacts");
        for contact in &anew.contacts {
            // A kept plane may tell of a little more than the margin.
            if contact.distance <= needed - (1.0 + 3.0 * slope_bound) * hold {
                let speaks = |kept: &Contact<f64>| speaks_for(kept, contact, slope_bound, hold);
                assert!(kept.contacts.iter().any(speaks), "frame {frame}: {contact:?} is missing");
                compared += 1;
            }
        }
        searched += kept.searched_count;
        searched_anew += anew.searched_count;
        let again = case.find(&query, &motion, &mut memory);
        assert_eq!(again.contacts, kept.contacts, "nothing has moved");
        assert_eq!(again.searched_count, 0, "nothing has moved");
        if is_straight {
            // Straight at the field and through it: what was far comes near, as fast as it can.
            if frame == 20 {
                case.world.bodies[0].position = center + direction * 1.1;
            }
            case.world.bodies[0].position -= direction * (random.between(0.05, 0.2) * THICKNESS);
            continue;
        }
        let way = HOLD * random.pick(&[0.02, 0.1, 0.4, 1.0, 3.0]) * if frame % 40 == 39 { 30.0 } else { 1.0 };
        case.shift(random, way, &anew.contacts);
    }
    println!("{compared} compared, {searched} searched, {searched_anew} anew");
    let share = if hold > 0.0 { 0.8 } else { 1.0 };
    assert!(compared > 5000 && (searched as f64) < share * searched_anew as f64, "{searched} of {searched_anew}");
}

fn pose(x: f64) -> Rigid {
    Rigid::new([x, 0.2, -0.1], [0.1, 0.3, -0.2, 0.9]).unwrap()
}

fn baked() -> Case {
    let ball = SpikedBall { levels: 3, radius: 0.6 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(32), ..BakeOptions::default() };
    Case::new(
        Field::bake(MeshView { points: &ball.points, faces: &ball.triangles }, &options).unwrap().field,
        pose(1.0),
    )
}

const VERTICES_TOO: Elements = Elements { faces: true, edges: false, vertices: true };

#[test]
fn a_rigid_surface_that_is_remembered_misses_nothing_that_a_search_anew_finds() {
    let mut random = Random::new(test_seed(6));
    let torus = || Case::new(Field::new(Torus::new(0.7, 0.2).unwrap()), pose(1.2));
    for hold in [HOLD, 0.0] {
        check(baked(), VERTICES_TOO, hold, &mut random);
        check(baked(), Elements::FACES, hold, &mut random);
        check(torus(), Elements { edges: true, ..VERTICES_TOO }, hold, &mut random);
    }
}

#[test]
fn a_contact_of_a_rigid_surface_is_kept_until_its_element_has_moved_by_hold() {
    let mut case = baked();
    let query = Query { elements: VERTICES_TOO, thickness: THICKNESS, hold: HOLD, ..Query::default() };
    let start = case.world.bodies[0].position;
    let mut memory = Memory::default();
    let touching = case.find(&query, &Motion::NONE, &mut memory).contacts.len();
    // There and back: the sum of all ways exceeds `hold` before the way from the start does.
    let mut searched = [0.6, 0.1, 0.6, 0.99, 1.01].map(|way| {
        case.world.bodies[0].position = start + V3::new(way * HOLD, 0.0, 0.0);
        case.find(&query, &Motion::NONE, &mut memory).searched_count
    });
    assert!(touching > 20 && searched[4] >= touching, "{touching} touch, {searched:?} are searched");
    // Until then some that did not touch are.
    searched[4] = 0;
    assert!(searched.iter().all(|count| *count < touching / 2), "{touching} touch, {searched:?} are searched");
}

#[test]
fn a_memory_of_other_kinds_of_elements_is_not_believed() {
    let case = baked();
    let find = |elements, memory: &mut Memory| {
        let query = Query { elements, thickness: THICKNESS, hold: HOLD, ..Query::default() };
        case.find(&query, &Motion::NONE, memory).contacts
    };
    let mut memory = Memory::default();
    find(Elements::FACES, &mut memory);
    assert_eq!(find(VERTICES_TOO, &mut memory), find(VERTICES_TOO, &mut Memory::default()));
}
