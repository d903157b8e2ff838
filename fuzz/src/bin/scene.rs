#![no_main]

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, ElementMethod, MeshSpec, SceneSpec, Stage};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    sdf_fuzz::limited(bytes, || {
        let Ok(text) = std::str::from_utf8(bytes) else { return };
        let Ok(mut spec) = scene::parse(text, "fuzz.toml") else { return };
        spec.shrink();
        if !make_small(&mut spec) {
            return;
        }
        let folder = Path::new("/nowhere");
        let Ok(obstacles) = Stage::obstacles(&spec, folder, Threads::ONE) else { return };
        for mut variant in scene::variants(&spec).take(2) {
            // Lists of substeps and speeds give them anew.
            (variant.frames, variant.substeps) = (1, variant.substeps.min(2));
            let stage = Stage::with_obstacles(&variant, folder, Threads::ONE, obstacles.clone());
            let Ok(mut stage) = stage else { return };
            let method: ElementMethod = "fw".parse().unwrap();
            let _ = scene::run(&variant, &mut stage, method, Threads::ONE, |_, _| ControlFlow::Continue(()));
        }
    });
});

/// Cuts what the file's numbers may ask for in time, not in kind; false for what cannot be cut.
fn make_small(spec: &mut SceneSpec) -> bool {
    for rigid in &mut spec.rigid {
        (rigid.cells, rigid.count) = (rigid.cells.min(8), rigid.count.map(|count| count.min(2)));
    }
    for soft in &mut spec.soft {
        (soft.cell, soft.padding, soft.cells) = (soft.cell.max(1.0), soft.padding.min(1.0), soft.cells.min(8));
    }
    spec.obstacle
        .iter_mut()
        .for_each(|obstacle| obstacle.cells = obstacle.mesh.as_ref().map(|_| obstacle.grid_cells().min(8)));
    let lists = [spec.cloth.len(), spec.rigid.len(), spec.soft.len(), spec.obstacle.len()];
    let cloths = spec.cloth.iter_mut().map(|cloth| &mut cloth.mesh);
    let others =
        spec.rigid.iter_mut().map(|rigid| &mut rigid.mesh).chain(spec.soft.iter_mut().map(|soft| &mut soft.mesh));
    cloths
        .chain(others)
        .chain(spec.obstacle.iter_mut().filter_map(|obstacle| obstacle.mesh.as_mut()))
        .for_each(make_coarse);
    lists.iter().all(|count| *count <= 4)
}

fn make_coarse(mesh: &mut MeshSpec) {
    match mesh {
        MeshSpec::Sheet(sheet) => sheet.cells = sheet.cells.map(|cells| cells.min(6)),
        MeshSpec::SpikedBall(ball) => ball.levels = ball.levels.min(1),
        MeshSpec::Serpent(serpent) => (serpent.rings, serpent.slices) = (serpent.rings.min(6), serpent.slices.min(6)),
        MeshSpec::Bowl(bowl) => (bowl.slices, bowl.stacks) = (bowl.slices.min(6), bowl.stacks.min(6)),
        MeshSpec::Pot(pot) => (pot.slices, pot.stacks) = (pot.slices.min(6), pot.stacks.min(6)),
        MeshSpec::Rope(rope) => (rope.strands, rope.edges) = (rope.strands.min(4), rope.edges.min(6)),
        MeshSpec::Cuboid(_) | MeshSpec::File(_) => {}
    }
}
