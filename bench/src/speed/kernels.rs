//! Fixed works on one thread, for counting instructions: those of a run that does the work once, minus those of a run that
//! only prepares it.

use std::hint::black_box;

use anyhow::{Result, bail};
use sdf_core::grid::owned::Layout;
use sdf_field::Method;

use super::bodies::{self, BOWL, POT};
use super::contacts::ContactScene;
use super::reading::obj_text;

use crate::bake;
use crate::on_threads;

/// Does a work of .ci/instructions.txt `times` times.
pub fn run(name: &str, times: u32) -> Result<()> {
    match name {
        "bake-dense-pseudo-normals" => bake(BOWL, 32, Layout::Dense, times),
        "bake-dense-winding" => bake(POT, 32, Layout::Dense, times),
        "bake-sparse" => bake(POT, 64, Layout::Sparse, times),
        "contacts-frank-wolfe" => contacts(Method::FrankWolfe, times),
        "contacts-certified" => contacts(Method::Auto, times),
        "read-obj" => read(times),
        _ => bail!("--kernel {name}: unknown; .ci/instructions.txt has the names"),
    }
}

fn bake(body: &str, resolution: u32, layout: Layout, times: u32) -> Result<()> {
    let body = bodies::body(body, 2_000);
    for _ in 0..times {
        black_box(on_threads(1, || bake::bake(&body, resolution, layout))??);
    }
    Ok(())
}

fn contacts(method: Method, times: u32) -> Result<()> {
    let scene = ContactScene::built_in(24)?;
    for _ in 0..times {
        black_box(on_threads(1, || scene.find(method))??);
    }
    Ok(())
}

fn read(times: u32) -> Result<()> {
    let text = obj_text(&bodies::body(POT, 40_000)).into_bytes();
    for _ in 0..times {
        black_box(sdf_formats::mesh::read_bytes(&text, "pot.obj")?);
    }
    Ok(())
}
