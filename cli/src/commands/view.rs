//! Writes a page of a field, of a mesh and their contacts.

use std::path::Path;

use anyhow::Result;
use sdf_core::Real;
use sdf_field::page::Scene;
use sdf_field::{ContactOptions, MeshView};
use sdf_formats::contact_file::ContactRecord;
use serde_json::json;

use crate::args::{Elements, ViewArgs};
use crate::commands::contacts::{require_elements, skipped};
use crate::commands::export::{named_after, stem};
use crate::failure::misuse;
use crate::mesh_input::is_standard_input;
use crate::page;
use crate::report::Report;
use crate::{field_input, mesh_input, output, progress};

pub fn run(args: &ViewArgs) -> Result<()> {
    let output = match &args.output {
        Some(output) => output.clone(),
        None if is_standard_input(&args.sdf) => misuse!("a field from standard input has no name: add -o"),
        None => named_after(&args.sdf, "html"),
    };
    let inputs: Vec<&Path> =
        [Some(&args.sdf), args.mesh.as_ref()].into_iter().flatten().map(|path| path.as_path()).collect();
    output::ensure_writable(&output, &inputs)?;
    let pose = args.pose.motion()?;
    let (contacts, [not_finite, undecided], page::Written { bytes, warning }) =
        progress::on_threads(args.threads, || {
            let field = field_input::read_whole(&args.sdf)?;
            let mesh = args.mesh.as_deref().map(mesh_input::read_mesh).transpose()?;
            let view = mesh.as_ref().map(|mesh| MeshView { points: &mesh.points, faces: &mesh.triangles });
            let (mut contacts, mut counts) = (Vec::new(), [0; 2]);
            let mut name = stem(&args.sdf);
            if let (Some(mesh), Some(view), Some(path)) = (&mesh, view, &args.mesh) {
                let elements = args.elements.unwrap_or(match (&mesh.triangles[..], &mesh.segments[..]) {
                    ([], []) => Elements::Vertices,
                    ([], _) => Elements::Edges,
                    _ => Elements::Faces,
                });
                require_elements(mesh, elements, &mesh_input::shown(path))?;
                let margin = args.margin.unwrap_or(0.0);
                let options = ContactOptions { margin, pose, elements: elements.into(), ..ContactOptions::default() };
                field_input::check_margin(&args.sdf, &field, &options)?;
                let found = match elements {
                    Elements::Edges => field.contacts_of_edges(&mesh.points, &mesh.edges(), &options)?,
                    Elements::Faces | Elements::Vertices => field.contacts(view, &options)?,
                };
                contacts = found.contacts.iter().map(ContactRecord::from).collect();
                counts = [found.not_finite_count, found.undecided_count];
                name = format!("{} on {name}", stem(path));
            }
            let segments = mesh.as_ref().map_or(&[][..], |mesh| &mesh.segments);
            let scene = Scene { name, field: &field, pose, mesh: view, segments, contacts: &contacts };
            let page = page::write(&output, &args.sdf, &scene)?;
            anyhow::Ok((contacts.len(), counts, page))
        })??;
    let mut rows = vec![("page", format!("{}, {bytes} bytes", output.display()))];
    if args.mesh.is_some() {
        rows.insert(0, ("contacts", contacts.to_string()));
    }
    if not_finite > 0 {
        rows.push(("skipped", skipped(not_finite, f64::MAX_COORDINATE)));
    }
    if undecided > 0 {
        rows.push((
            "undecided",
            format!("{undecided} elements may be within the margin: `contacts --complete` lists them"),
        ));
    }
    let output = output.display().to_string();
    let mut json = json!({"schema": "sdftool.view/1", "output": output, "bytes": bytes, "contacts": contacts});
    if args.mesh.is_some() {
        json["not_finite"] = not_finite.into();
        json["undecided"] = undecided.into();
    }
    if let Some(warning) = warning {
        json["warning"] = warning.into();
    }
    Report { rows, json }.print(args.json)
}
