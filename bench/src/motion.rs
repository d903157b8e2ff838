//! Two rigid bodies that touch, frame after frame: what do clusters of faces save? And how long does a first touch take? On one
//! thread; the ways take turns, and every time is a median.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Result, ensure};
use sdf_core::contact::{FirstTouch, MovingElement, Touch};
use sdf_core::grid::owned::Layout;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Rigid;
use sdf_field::{ContactOptions, Contacts, Field, MeshClusters, MeshInMotion, MeshView, Method, Threads};
use sdf_procedural::random::Random;
use sdf_procedural::{Mesh, SpikedBall};

use crate::bake::bake;
use crate::statistics::median;

const FRAMES: u32 = 15;

/// Prints a line for each method, and one for first touches.
pub fn run() -> Result<()> {
    let body = SpikedBall { levels: 6, radius: 0.8 }.mesh();
    let field = bake(&SpikedBall { levels: 4, radius: 0.8 }.mesh(), 128, Layout::Dense)?;
    println!("two bodies of {} faces each, both ways, 128 cells", body.triangles.len());
    for method in [Method::FrankWolfe, Method::Auto] {
        clusters(&body, &field, method)?;
    }
    first_touches(&body, &field);
    Ok(())
}

/// The second body rolls over the first.
fn poses(frame: u32) -> [Rigid; 2] {
    let turn = 0.02 * f64::from(frame);
    let rolled = Rigid::new([1.72, 0.02 * turn, 0.0], [0.0, turn.sin(), 0.3, turn.cos()]).expect("a rotation");
    [Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).expect("no rotation"), rolled]
}

fn clusters(body: &Mesh, field: &Field, method: Method) -> Result<()> {
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let start = Instant::now();
    let mut clusters = MeshClusters::new(mesh)?;
    let build = start.elapsed().as_secs_f64();
    let start = Instant::now();
    clusters.refit(mesh)?;
    let refit = start.elapsed().as_secs_f64();
    let options = ContactOptions { margin: 0.005, method, threads: Threads::ONE, ..ContactOptions::default() };
    let detect = |frame: u32, clusters: Option<&MeshClusters>| -> Result<[Contacts; 2]> {
        let [a, b] = poses(frame);
        let one_way = |mesh_pose, field_pose| {
            let mesh = MeshInMotion { pose: Some(mesh_pose), clusters, ..MeshInMotion::new(mesh) };
            field.contacts_in_motion(&mesh, &ContactOptions { pose: Some(field_pose), ..options })
        };
        Ok([one_way(a, b)?, one_way(b, a)?])
    };
    let (mut times, mut contacts) = ([vec![], vec![]], 0);
    for frame in 0..FRAMES {
        let mut found = [None, None];
        for (variant, clusters) in [None, Some(&clusters)].into_iter().enumerate() {
            let start = Instant::now();
            found[variant] = Some(black_box(detect(frame, clusters)?));
            times[variant].push(1e3 * start.elapsed().as_secs_f64());
        }
        ensure!(found[0] == found[1], "frame {frame}: clusters change the contacts");
        contacts += found[0].iter().flatten().map(|found| found.contacts.len()).sum::<usize>();
    }
    let [all, clustered] = times.map(median);
    println!(
        "{method:?}: {all:.2} ms a frame, {clustered:.2} ms with clusters ({:.1} ×), {:.0} contacts; clusters are built in {:.1} ms \
         and fitted again in {:.2} ms",
        all / clustered,
        contacts as f64 / f64::from(FRAMES),
        1e3 * build,
        1e3 * refit,
    );
    Ok(())
}

/// Faces of the body fly at the field, each along a path of its own.
fn first_touches(body: &Mesh, field: &Field) {
    let mut random = Random::new(15);
    let (mut times, mut touched, mut open) = (vec![], 0, 0);
    for id in 0..2000_u32 {
        let corners = random.pick(&body.triangles).map(|corner| Vector3::from(body.points[corner as usize]) * 2.0);
        let shift = -corners[0] + Vector3::from(random.point_in_cube(1.0));
        let turn = [0; 3].map(|_| Vector3::from(random.point_in_cube(0.1)));
        let path = std::array::from_fn(|k| [corners[k], corners[k] + shift + turn[k]]);
        let moving = MovingElement { id, vertices: [0, 1, 2], path };
        let search = FirstTouch { tolerance: 1e-3, ..FirstTouch::default() };
        let start = Instant::now();
        let touch = black_box(search.first_touch(field.as_any(), 0.0, &moving));
        times.push(1e6 * start.elapsed().as_secs_f64());
        touched += u32::from(matches!(touch, Touch::At { .. }));
        open += u32::from(matches!(touch, Touch::BudgetSpent { .. }));
    }
    let worst = times.iter().fold(0.0_f64, |worst, time| worst.max(*time));
    println!(
        "first touch of 2000 flying faces, to 1e-3: {:.1} µs each (median), {worst:.0} µs at most; {touched} touch, {open} are left open",
        median(times),
    );
}
