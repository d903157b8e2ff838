//! Sheets: at rest on a grid, and stiff ones by passes one way and there and back.

use sdf_core::shapes::{HalfSpace, Torus};
use sdf_field::{BakeOptions, Field, GridSize, MeshView, Method, Threads};
use sdf_procedural::{Sheet, SpikedBall};
use sdf_sim::{Contacts, Elements, Memory, Motion, Passes, Query, Surface, World, cloth};

use crate::{V3, falling};

fn sheet(cells: u32, size: f64, height: f64) -> sdf_procedural::Mesh {
    Sheet { cells: [cells; 2], size: [size; 2], height, bend: 0.0, floor: -9.0, holes: None, faces: None }.mesh()
}

struct Run {
    world: World,
    surface: Surface,
    memory: Memory,
    contacts: Contacts,
    substeps: u32,
}

impl Run {
    fn new(mesh: &sdf_procedural::Mesh, substeps: u32) -> Self {
        let mut world = falling();
        let surface = cloth::add(&mut world, &mesh.points, &mesh.triangles, &cloth::Fabric::default());
        Self { world, surface, memory: Memory::default(), contacts: Contacts::default(), substeps }
    }

    fn frame(&mut self, field: &Field, query: &Query) {
        let dt = 1.0 / (60.0 * f64::from(self.substeps));
        let motion = Motion::of(&self.world, 1.0 / 60.0);
        self.contacts.clear();
        let Self { world, surface, memory, contacts, .. } = self;
        query.find_again(field, surface, world, &motion, memory, contacts).unwrap();
        for _ in 0..self.substeps {
            self.world.step(dt, self.contacts.rows());
        }
    }
}

fn spiked_ball() -> Field {
    let mesh = SpikedBall { levels: 1, radius: 0.6 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(48), ..BakeOptions::default() };
    Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field
}

/// Root mean square of what the points of a sheet at rest move within a frame, times 60.
fn jitter(field: &Field, method: Method, thickness: f64) -> f64 {
    let mut run = Run::new(&sheet(24, 1.6, 1.05), 10);
    run.world.drag = 0.5;
    let query = Query { method, thickness, friction: 0.5, ..Query::default() };
    (0..240).for_each(|_| run.frame(field, &query));
    let mut sum = 0.0;
    for _ in 0..30 {
        let before = run.world.x.clone();
        run.frame(field, &query);
        sum += run.world.x.iter().zip(&before).map(|(now, before)| (now - before).norm_squared()).sum::<f64>();
    }
    assert!(run.contacts.contacts.len() > 20, "it rests on {} contacts", run.contacts.contacts.len());
    60.0 * (sum / (30 * run.world.x.len()) as f64).sqrt()
}

#[test]
fn a_sheet_at_rest_jitters_no_more_with_auto_than_with_frank_wolfe() {
    let field = spiked_ball();
    let mean =
        |method| [0.0078, 0.008, 0.0082].map(|thickness| jitter(&field, method, thickness)).iter().sum::<f64>() / 3.0;
    let (auto, frank_wolfe) = (mean(Method::Auto), mean(Method::FrankWolfe));
    println!("auto {auto}, Frank-Wolfe {frank_wolfe}");
    assert!(auto <= frank_wolfe.max(0.005) * 1.25, "auto {auto}, Frank-Wolfe {frank_wolfe}");
}

#[test]
fn a_sheet_comes_to_rest_on_contacts_that_are_kept() {
    let field = spiked_ball();
    let mut run = Run::new(&sheet(24, 1.6, 1.05), 10);
    run.world.drag = 1.0;
    let query = Query { thickness: 0.008, friction: 0.5, hold: 4e-4, ..Query::default() };
    (0..480).for_each(|_| run.frame(&field, &query));
    let (mut sum, mut contacts, mut same) = (0.0, 0, 0);
    for _ in 0..30 {
        let (before, normals) = (run.world.x.clone(), run.contacts.contacts.clone());
        run.frame(&field, &query);
        sum += run.world.x.iter().zip(&before).map(|(now, before)| (now - before).norm_squared()).sum::<f64>();
        contacts += run.contacts.contacts.len();
        let is_kept = |contact: &&sdf_core::contact::Contact<f64>| {
            normals.iter().any(|then| then.key() == contact.key() && then.normal == contact.normal)
        };
        same += run.contacts.contacts.iter().filter(is_kept).count();
    }
    let speed = 60.0 * (sum / (30 * run.world.x.len()) as f64).sqrt();
    println!("speed {speed}, {same} of {contacts} contacts are those of the frame before");
    assert!(speed < 0.005, "{speed}");
    assert!(contacts > 1000 && same * 10 > contacts * 9, "{same} of {contacts}");
}

#[test]
fn a_memory_leaves_out_no_contact_and_keeps_none_that_is_off() {
    let field = spiked_ball();
    let mut run = Run::new(&sheet(24, 1.6, 1.05), 10);
    let query = Query { thickness: 0.008, hold: 4e-4, one_per_feature: false, ..Query::default() };
    let (mut compared, mut kept) = (0, 0);
    for frame in 0..240 {
        run.frame(&field, &query);
        if frame % 10 != 9 {
            continue;
        }
        let motion = Motion::of(&run.world, 1.0 / 60.0);
        let [mut fresh, mut again] = [Contacts::default(), Contacts::default()];
        query.find(&field, &run.surface, &run.world, &motion, &mut fresh).unwrap();
        query.find_again(&field, &run.surface, &run.world, &motion, &mut run.memory.clone(), &mut again).unwrap();
        for contact in &fresh.contacts {
            let of_element = again.contacts.iter().filter(|other| other.element == contact.element);
            let deepest = of_element.map(|other| other.distance).fold(f64::INFINITY, f64::min);
            // Near the limit of the margin one of the two may lie beyond it.
            let is_far = contact.distance > query.thickness;
            assert!(is_far || deepest <= contact.distance + 3.0 * query.hold, "{deepest} for {}", contact.distance);
            compared += usize::from(!is_far);
        }
        let at = |contact: &sdf_core::contact::Contact<f64>| {
            field.sample(&[contact.point.into()], Threads::ONE)[0].value - contact.distance
        };
        kept += again.contacts.iter().filter(|contact| at(contact) != 0.0).count();
        let worst = again.contacts.iter().map(|contact| at(contact).abs()).fold(0.0, f64::max);
        assert!(worst <= 2.0 * query.hold, "a contact that was kept is off by {worst}");
    }
    assert!(compared > 500 && kept > 100, "{compared} compared, {kept} kept");
}

#[test]
fn a_light_corner_is_not_thrown_over_its_sheet() {
    let field = spiked_ball();
    let mut run = Run::new(&sheet(24, 1.6, 1.12), 1);
    run.world.v.fill(V3::new(0.0, 0.0, -3.0));
    run.world.inv_mass.iter_mut().step_by(2).for_each(|inv_mass| *inv_mass /= 1000.0);
    run.world.stretches.iter_mut().for_each(|stretch| stretch.compliance = 0.0);
    let query = Query { thickness: 0.01, ..Query::default() };
    let speeds = (0..60).map(|_| {
        run.frame(&field, &query);
        run.world.max_speed()
    });
    let fastest = speeds.fold(0.0, f64::max);
    println!("{fastest}");
    assert!(fastest < 30.0, "{fastest}");
}

#[test]
fn a_stiff_sheet_explodes_one_way_and_not_there_and_back() {
    let field = Field::new(Torus::new(0.6, 0.2).unwrap());
    let gain = |passes| {
        let mut run = Run::new(&sheet(24, 1.6, 0.3), 10);
        run.world.stretches.iter_mut().for_each(|stretch| stretch.compliance = 0.0);
        run.world.passes = passes;
        let query = Query { thickness: 0.01, friction: 0.0, method: Method::FrankWolfe, ..Query::default() };
        let start = run.world.energy();
        let gains = (0..90).map(|_| {
            run.frame(&field, &query);
            run.world.energy() - start
        });
        gains.fold(0.0, f64::max) / start
    };
    let (there_and_back, one_way) = (gain(Passes::ThereAndBack), gain(Passes::OneWay));
    println!("there and back {there_and_back}, one way {one_way}");
    assert!(there_and_back < 1e-3, "{there_and_back}");
    assert!(one_way > 10.0, "{one_way}");
}

#[test]
fn a_sheet_that_hangs_from_one_point_stretches_less_with_rounds_over_loaded_edges() {
    let stretch = |rounds| {
        let mut run = Run::new(&sheet(40, 1.0, 0.0), 10);
        let at_rest = run.world.clone();
        run.world.inv_mass[20 * 41 + 20] = 0.0;
        run.world.drag = 5.0;
        run.world.loaded_rounds = rounds;
        for _ in 0..600 {
            run.world.step(1.0 / 300.0, run.contacts.rows());
        }
        run.surface.max_stretch(&run.world, &at_rest)
    };
    let [without, with] = [0, 2].map(stretch);
    println!("without {without}, with {with}");
    assert!(with - 1.0 < 0.5 * (without - 1.0), "without {without}, with {with}");
}

#[test]
fn faces_keep_a_coarse_sheet_off_thin_spikes_and_vertices_do_not() {
    let field = spiked_ball();
    let deep = |elements| {
        let mut run = Run::new(&sheet(10, 1.6, 1.05), 20);
        let query = Query { elements, thickness: 0.01, ..Query::default() };
        (0..60).for_each(|_| run.frame(&field, &query));
        let truth = Query { one_per_feature: false, method: Method::Certified, ..Query::default() };
        let mut found = Contacts::default();
        truth.find(&field, &run.surface, &run.world, &Motion::NONE, &mut found).unwrap();
        found.contacts.iter().filter(|contact| contact.distance < -0.0025).count()
    };
    let (faces, vertices) = (deep(Elements::FACES), deep(Elements::VERTICES));
    println!("deep: faces {faces}, vertices {vertices}");
    assert_eq!(faces, 0);
    assert!(vertices > 5, "{vertices}");
}

/// A face that comes down level is lowest anywhere: its other corners must not go on until the next search.
#[test]
fn no_vertex_of_a_level_sheet_passes_a_floor() {
    let thickness = 0.004;
    let lowest = |cells, speed: f64, struck_vertices| {
        let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
        let mut run = Run::new(&sheet(cells, 1.0, 0.02), 10);
        run.world.v.iter_mut().for_each(|velocity| velocity.z = -speed);
        let query = Query { struck_vertices, thickness, ..Query::default() };
        let frames = (0..20).map(|_| {
            run.frame(&floor, &query);
            run.world.x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min)
        });
        frames.fold(f64::INFINITY, f64::min)
    };
    for cells in [1, 2, 5, 8, 13] {
        for speed in [0.0, 1.0, 3.0, 10.0] {
            let above = lowest(cells, speed, true);
            // What touches already sinks in a frame by the thickness and what it falls, at most.
            let fall = 0.5 * 9.81 / 3600.0;
            assert!(above > -1.5 * fall, "{cells} cells at {speed}: down to {above}");
        }
    }
    assert!(lowest(1, 3.0, false) < -10.0 * thickness);
}

#[test]
fn any_number_of_threads_moves_everything_to_the_same_bits() {
    let field = spiked_ball();
    let run = |threads| {
        let mut run = Run::new(&sheet(30, 1.6, 1.02), 4);
        let query = Query { threads: Threads::new(threads), thickness: 0.01, ..Query::default() };
        (0..20).for_each(|_| run.frame(&field, &query));
        assert!(!run.contacts.contacts.is_empty());
        run.world.x
    };
    let one: Vec<V3> = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}
