//! Fixed works on one thread, so that instructions can be counted: those of a run that does the work once, less those of a run
//! that only prepares it.

use std::hint::black_box;

use anyhow::{Result, bail};
use clap::Parser;

use super::bodies::{self, BOWL, POT};
use super::contacts::Scene;
use super::reading::obj;
use super::turns::timed;
use crate::args::{BakeArgs, Method};
use crate::commands::bake;

/// Does the work so many times. The names stand in .ci/instructions.txt.
pub fn run(name: &str, times: u32) -> Result<()> {
    match name {
        "bake-dense-pseudo-normals" => bake(BOWL, &["--res", "32"], times),
        "bake-dense-winding" => bake(POT, &["--res", "32"], times),
        "bake-sparse" => bake(POT, &["--res", "64", "--layout", "sparse"], times),
        "contacts-frank-wolfe" => contacts(Method::Fw, times),
        "contacts-certified" => contacts(Method::Auto, times),
        "read-obj" => read(times),
        _ => bail!("{name} is no kernel: they stand in .ci/instructions.txt"),
    }
}

fn bake(body: &str, options: &[&str], times: u32) -> Result<()> {
    let input = bodies::body(body, 2_000);
    let args = BakeArgs::try_parse_from(["bake", "mesh"].iter().chain(options))?;
    for _ in 0..times {
        let input = input.clone();
        let (baked, _) = timed(1, || bake::bake(&args, input))?;
        black_box(baked?);
    }
    Ok(())
}

fn contacts(method: Method, times: u32) -> Result<()> {
    let scene = Scene::own(24)?;
    for _ in 0..times {
        black_box(scene.find(method, 1, None)?);
    }
    Ok(())
}

fn read(times: u32) -> Result<()> {
    let text = obj(&bodies::body(POT, 40_000)).into_bytes();
    for _ in 0..times {
        black_box(sdf_formats::mesh::read_bytes(&text, "pot.obj")?);
    }
    Ok(())
}
