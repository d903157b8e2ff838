//! Two rigid bodies that touch, frame after frame: what do clusters of faces save? How long does a first touch take, how long a
//! deformed cage before the search in it, and how long a reduction of contacts? On one thread, in its processor time; the ways take turns, and every time is a median.

use std::hint::black_box;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use cpu_time::ThreadTime;
use sdf_core::Aabb;
use sdf_core::contact::{FirstTouch, MovingElement, Reduced, Reduction, Touch};
use sdf_core::grid::owned::Layout;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Rigid;
use sdf_core::shapes::HalfSpace;
use sdf_field::{ContactOptions, Contacts, Elements, Field, MeshClusters, MeshInMotion, MeshView, Method, Threads};
use sdf_procedural::random::Random;
use sdf_procedural::{Mesh, SpikedBall};
use sdf_sim::scene::{self, Stage};
use sdf_sim::{CageRoom, Motion, Query};

use crate::bake::bake;
use crate::statistics::median;

const FRAMES: u32 = 15;

/// Prints a line for each method, and some for first touches, reductions and a cage; with a mesh also lines for two of it at several distances.
pub fn run(mesh: Option<&Path>) -> Result<()> {
    let body = SpikedBall { levels: 6, radius: 0.8 }.mesh();
    let field = bake(&SpikedBall { levels: 4, radius: 0.8 }.mesh(), 128, Layout::Dense)?;
    println!("two bodies of {} faces each, both ways, 128 cells", body.triangles.len());
    for method in [Method::FrankWolfe, Method::Auto] {
        clusters(&body, &field, method, 0.005, FRAMES, poses)?;
    }
    for evaluations in [1 << 12, 1 << 14, 1 << 16, 1 << 18] {
        first_touches(&body, &field, evaluations);
    }
    for side in [42, 100] {
        reductions(side)?;
    }
    cage()?;
    if let Some(path) = mesh {
        let mesh = sdf_formats::mesh::read(path)?;
        let mesh = Mesh { points: mesh.points, triangles: mesh.triangles, segments: vec![] };
        two_of(&mesh)?;
    }
    Ok(())
}

/// A flat face of so many vertices along each side, in a floor: level, and rough by a fifth of its depth.
fn reductions(side: u32) -> Result<()> {
    let (depth, margin) = (0.01, 0.0);
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).context("a direction")?);
    let mut random = Random::new(16);
    for roughness in [0.0, 0.2] {
        let at = |n: u32| f64::from(n) / f64::from(side - 1);
        let points: Vec<[f64; 3]> = (0..side * side)
            .map(|id| [at(id % side), at(id / side), -depth * (1.0 - roughness * random.unit())])
            .collect();
        let options = ContactOptions { elements: Elements::Vertices, margin, ..ContactOptions::default() };
        let found = floor.contacts(MeshView { points: &points, faces: &[] }, &options)?;
        for count in [4, 16, 64] {
            let reduction = Reduction { count, movement: depth, thickness: 0.0 };
            let (mut times, mut last) = (vec![], None);
            for _ in 0..FRAMES {
                let mut contacts = found.clone();
                let start = ThreadTime::now();
                last = Some(black_box(contacts.reduce(&reduction)?));
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
            let Reduced { count, shortfall } = last.context("a frame")?;
            println!(
                "{} contacts of a face, rough by {roughness}, to {count}: {:.2} ms, shortfall {:.1e} of the movement",
                found.contacts.len(),
                median(times),
                shortfall / depth,
            );
        }
    }
    Ok(())
}

/// Two of a mesh beside each other along x, as they stand and one of them turned.
fn two_of(mesh: &Mesh) -> Result<()> {
    let bounds = Aabb::from_points(mesh.points.iter().copied()).context("a mesh without points")?;
    let length = bounds.longest_side();
    let field = bake(mesh, 128, Layout::Dense)?;
    println!("two of {} faces each, both ways, 128 cells, margin 0.002 of the length", mesh.triangles.len());
    for (turn, apart) in [0.0, 0.3].into_iter().flat_map(|turn| [0.92, 0.86, 0.8, 0.7].map(|apart| (turn, apart))) {
        println!("{apart} of the length apart, turned by {turn}");
        let poses = |frame: u32| {
            let shift = [length * (apart + 1e-4 * f64::from(frame)), 0.0, 0.0];
            let turned = Rigid::new(shift, [0.2 * turn, 0.3 * turn, turn, 1.0]).expect("a rotation");
            [Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).expect("no rotation"), turned]
        };
        for method in [Method::FrankWolfe, Method::Auto] {
            clusters(mesh, &field, method, 0.002 * length, 5, poses)?;
        }
    }
    Ok(())
}

/// The scene of a cloth on a soft body: what it takes to know the cage as it is now, and to search in it.
fn cage() -> Result<()> {
    let text = include_str!("../../scenes/09-cloth-on-soft-pot.toml");
    let spec = scene::parse(text, "09-cloth-on-soft-pot")?;
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE)?;
    let [body] = &stage.cages.clone()[..] else { panic!("one soft body") };
    let (mut rest_room, mut room) = (CageRoom::default(), CageRoom::default());
    let rest = body.at_rest(&mut rest_room).context("a body with tetrahedra")?;
    let (mut rebuilds, mut searches, mut contacts) = (vec![], vec![], 0);
    let query = Query { thickness: spec.thickness, ..Query::default() };
    scene::run(&spec, &mut stage, "auto".parse()?, Threads::ONE, |frame, stage| {
        if frame % 5 == 0 {
            let mut found = sdf_sim::Contacts::default();
            let motion = Motion::of(&stage.world, 1.0 / spec.rate);
            let (start, mut search) = (ThreadTime::now(), 0.0);
            let result = body.with_obstacle(&rest, &stage.world, &mut room, |obstacle| {
                let start = ThreadTime::now();
                let result = query.find(obstacle, &stage.surfaces[0], &stage.world, &motion, &mut found);
                search = start.elapsed().as_secs_f64();
                result
            });
            result.expect("a body with tetrahedra").expect("vertices that are there");
            rebuilds.push(1e3 * (start.elapsed().as_secs_f64() - search));
            searches.push(1e3 * search);
            contacts += found.contacts.len();
        }
        ControlFlow::Continue(())
    })?;
    let sum = |times: &[f64]| times.iter().sum::<f64>();
    println!(
        "a cage of {} tetrahedra: {:.3} ms to know it anew, {:.3} ms to search {} faces, {:.0} contacts; over all frames {:.2} of the search",
        stage.world.tets.len(),
        median(rebuilds.clone()),
        median(searches.clone()),
        stage.surfaces[0].faces.len(),
        contacts as f64 / searches.len() as f64,
        sum(&rebuilds) / sum(&searches),
    );
    Ok(())
}

/// The second body rolls over the first.
fn poses(frame: u32) -> [Rigid; 2] {
    let turn = 0.02 * f64::from(frame);
    let rolled = Rigid::new([1.72, 0.02 * turn, 0.0], [0.0, turn.sin(), 0.3, turn.cos()]).expect("a rotation");
    [Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).expect("no rotation"), rolled]
}

fn clusters(
    body: &Mesh,
    field: &Field,
    method: Method,
    margin: f64,
    frames: u32,
    poses: impl Fn(u32) -> [Rigid; 2],
) -> Result<()> {
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let start = ThreadTime::now();
    let mut clusters = MeshClusters::new(mesh)?;
    let build = start.elapsed().as_secs_f64();
    let start = ThreadTime::now();
    clusters.refit(mesh)?;
    let refit = start.elapsed().as_secs_f64();
    let options = ContactOptions { margin, method, threads: Threads::ONE, ..ContactOptions::default() };
    let detect = |frame: u32, clusters: Option<&MeshClusters>| -> Result<[Contacts; 2]> {
        let [a, b] = poses(frame);
        let one_way = |mesh_pose, field_pose| {
            let mesh = MeshInMotion { pose: Some(mesh_pose), clusters, ..MeshInMotion::new(mesh) };
            field.contacts_in_motion(&mesh, &ContactOptions { pose: Some(field_pose), ..options })
        };
        Ok([one_way(a, b)?, one_way(b, a)?])
    };
    let (mut times, mut contacts) = ([vec![], vec![]], 0);
    for frame in 0..frames {
        let mut found = [None, None];
        for (variant, clusters) in [None, Some(&clusters)].into_iter().enumerate() {
            let start = ThreadTime::now();
            found[variant] = Some(black_box(detect(frame, clusters)?));
            times[variant].push(1e3 * start.elapsed().as_secs_f64());
        }
        let [all, clustered] = found.each_ref().map(|found| found.iter().flatten().map(|found| &found.contacts));
        // Clusters spare some elements the search too: only what was found is the same.
        ensure!(all.clone().eq(clustered), "frame {frame}: clusters change the contacts");
        contacts += all.map(Vec::len).sum::<usize>();
    }
    let [all, clustered] = times.map(median);
    println!(
        "{method:?}: {all:.2} ms a frame, {clustered:.2} ms with clusters ({:.1} ×), {:.0} contacts; clusters are built in {:.1} ms \
         and fitted again in {:.2} ms",
        all / clustered,
        contacts as f64 / f64::from(frames),
        1e3 * build,
        1e3 * refit,
    );
    Ok(())
}

/// Faces of the body fly at the field, each along a path of its own.
fn first_touches(body: &Mesh, field: &Field, evaluations: u32) {
    let mut random = Random::new(15);
    let (mut times, mut touched, mut open) = (vec![], 0, 0);
    for id in 0..2000_u32 {
        let corners = random.pick(&body.triangles).map(|corner| Vector3::from(body.points[corner as usize]) * 2.0);
        let shift = -corners[0] + Vector3::from(random.point_in_cube(1.0));
        let turn = [0; 3].map(|_| Vector3::from(random.point_in_cube(0.1)));
        let path = std::array::from_fn(|k| [corners[k], corners[k] + shift + turn[k]]);
        let moving = MovingElement { id, vertices: [0, 1, 2], path };
        let search = FirstTouch { tolerance: 1e-3, evaluations };
        let start = ThreadTime::now();
        let touch = black_box(search.first_touch(field.as_any(), 0.0, &moving));
        times.push(1e6 * start.elapsed().as_secs_f64());
        touched += u32::from(matches!(touch, Touch::At { .. }));
        open += u32::from(matches!(touch, Touch::BudgetSpent { .. }));
    }
    let worst = times.iter().fold(0.0_f64, |worst, time| worst.max(*time));
    println!(
        "first touch of 2000 flying faces, to 1e-3, in {evaluations} evaluations: {:.1} µs each (median), {:.1} (mean), {worst:.0} at most; \
         {touched} touch, {open} are left open",
        median(times.clone()),
        times.iter().sum::<f64>() / times.len() as f64,
    );
}
