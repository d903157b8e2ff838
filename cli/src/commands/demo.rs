//! Bakes a body, finds the contacts of a cloth with it, and draws them, all from formulas: no input file is needed.

use std::path::Path;

use anyhow::{Context, Result};
use clap::Parser;
use sdf_core::Sdf;
use sdf_field::Field;
use sdf_formats::mesh::{self, MeshFormat};
use sdf_procedural::{self as procedural, Sheet, SpikedBall};
use serde_json::json;

use crate::args::{BakeArgs, ContactsArgs, DemoArgs};
use crate::commands::{bake, contacts};
use crate::device::Searcher;
use crate::mesh_input::{self, with_path};
use crate::output;
use crate::pictures::{Picture, Plane};
use crate::report::{Report, number};

/// Largest distance from the plane at which a contact is drawn; the body's radius is 1.
const DRAWN_WITHIN: f64 = 0.03;

pub fn run(args: &DemoArgs) -> Result<()> {
    let folder = &args.output;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = |name: &str| folder.join(name);
    let (body, cloth, grid) = (file("body.obj"), file("cloth.obj"), file("body.sdf.h5"));
    let (list, picture) = (file("contacts.csv"), file("contacts.png"));
    [&body, &cloth, &grid, &list, &picture].into_iter().try_for_each(|file| output::ensure_writable(file, &[]))?;

    let procedural::Mesh { points, triangles, .. } = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    with_path(&body, mesh::write(&body, MeshFormat::Obj, &points, &triangles))?;
    let procedural::Mesh { points, triangles, .. } = cloth_over_body().mesh();
    with_path(&cloth, mesh::write(&cloth, MeshFormat::Obj, &points, &triangles))?;

    let bake_args =
        BakeArgs::try_parse_from(["bake", "--res", "128", "--"].map(Path::new).into_iter().chain([body.as_path()]))?;
    let input = mesh_input::read(&body)?;
    let (baked, input) = bake::bake(&bake_args, input)?;
    baked.field.save(&grid)?;

    let contacts_args = ContactsArgs::try_parse_from(["contacts".as_ref(), "--".as_ref(), cloth.as_path(), &grid])?;
    let cloth_mesh = mesh_input::read_mesh(&cloth)?;
    let field = Field::open(&grid)?;
    let found = contacts::find(&contacts_args, &Searcher::open(&contacts_args.device)?, &cloth_mesh, &field)?;
    let list_format = sdf_formats::contact_file::ContactFormat::Csv;
    with_path(&list, sdf_formats::contact_file::write(&list, list_format, found.records(), |_| Ok(())))?;
    draw(field.as_any(), &cloth_mesh, &found, &picture)?;

    let deepest = found.records().map(|contact| contact.distance).fold(0.0, f64::min);
    Report {
        rows: vec![
            ("body", format!("{}, {} triangles", body.display(), input.triangles)),
            ("cloth", format!("{}, {} triangles", cloth.display(), cloth_mesh.triangles.len())),
            ("field", format!("{}, {}", grid.display(), baked.field.info().map_or("", |info| &info.sign_reason))),
            ("contacts", format!("{}, {} of them", list.display(), found.rows.len())),
            ("deepest", number(deepest)),
            ("picture", picture.display().to_string()),
        ],
        json: json!({
            "schema": "sdftool.demo/1",
            "folder": folder.display().to_string(),
            "elements": found.elements,
            "passed_cull": found.passed_cull,
            "contacts": found.rows.len(),
            "deepest": deepest,
        }),
    }
    .print(args.json)
}

/// A square sheet that hangs over the body, low enough for the spikes to pierce it.
fn cloth_over_body() -> Sheet {
    Sheet { cells: [60, 60], size: [2.4, 2.4], height: 0.86, bend: 0.45, floor: -0.6, holes: None, faces: None }
}

/// Draws a section through the body's middle: the cloth as a green line, contacts as red dots.
fn draw<F: Sdf>(field: &F, cloth: &mesh::Mesh, found: &contacts::ContactList<'_>, path: &Path) -> Result<()> {
    const GREEN: [u8; 3] = [20, 130, 60];
    const RED: [u8; 3] = [200, 30, 40];
    let window = sdf_core::Aabb { min: [-1.25; 3], max: [1.25; 3] };
    let mut picture = Picture::new(field, Plane { axis: 1, at: 0.0, window }, 900, None);
    for corners in &cloth.triangles {
        let corners = corners.map(|corner| cloth.points[corner as usize]);
        if let [from, to] = cut(corners)[..] {
            picture.line(from, to, 1.2, GREEN);
        }
    }
    for contact in found.records().filter(|contact| contact.point[1].abs() < DRAWN_WITHIN) {
        picture.dot(contact.point, 4.0, RED);
    }
    picture.write(path)
}

/// Points at which the plane y = 0 cuts a triangle's edges.
fn cut(corners: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
    let sides = [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end: usize| corners[end]));
    let crossing = |[from, to]: [[f64; 3]; 2]| {
        let t = from[1] / (from[1] - to[1]);
        ((from[1] <= 0.0) != (to[1] <= 0.0))
            .then(|| std::array::from_fn(|axis| from[axis] + t * (to[axis] - from[axis])))
    };
    sides.into_iter().filter_map(crossing).collect()
}
