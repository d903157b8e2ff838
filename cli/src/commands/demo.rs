//! The main job with nothing at hand.

use std::path::Path;

use anyhow::{Context, Result};
use clap::Parser;
use sdf_core::Sdf;
use sdf_formats::field_file;
use sdf_formats::field_file::Field;
use sdf_formats::grid_file::StoredGrid;
use sdf_formats::mesh::{self, MeshFormat};
use serde_json::json;

use crate::args::{BakeArgs, ContactsArgs, DemoArgs};
use crate::commands::{bake, contacts};
use crate::mesh_input::{self, at};
use crate::pictures::{Picture, Plane};
use crate::report::{Report, number};

/// Contacts are drawn when they lie this near to the plane, in the body's size.
const DRAWN_WITHIN: f64 = 0.03;

pub fn run(args: &DemoArgs) -> Result<()> {
    let folder = &args.output;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = |name: &str| folder.join(name);
    let (body, cloth, grid) = (file("body.obj"), file("cloth.obj"), file("body.sdf.h5"));
    let (list, picture) = (file("contacts.csv"), file("contacts.png"));

    let Model { points, triangles } = spiky_body();
    at(&body, mesh::write(&body, MeshFormat::Obj, &points, &triangles))?;
    let Model { points, triangles } = cloth_over_body();
    at(&cloth, mesh::write(&cloth, MeshFormat::Obj, &points, &triangles))?;

    let bake_args = BakeArgs::try_parse_from([Path::new("bake"), &body, "--res".as_ref(), "128".as_ref()])?;
    let input = mesh_input::read(&body)?;
    let baked = bake::bake(&bake_args, &input)?;
    let about = bake::about(&bake_args, &input, &baked);
    baked.grid.write(&grid, &baked.lattice, baked.band, &about)?;

    let contacts_args = ContactsArgs::try_parse_from([Path::new("contacts"), &cloth, &grid])?;
    let cloth_mesh = mesh_input::read(&cloth)?.mesh;
    let field = field_file::read(&grid)?;
    let found = contacts::find(&contacts_args, &cloth_mesh, &field)?;
    let list_format = sdf_formats::contact_file::ContactFormat::Csv;
    at(&list, sdf_formats::contact_file::write(&list, list_format, &found.contacts, Vec::new))?;
    let Field::Grid(StoredGrid { grid: baked_grid, .. }) = &field else { unreachable!("a grid was written") };
    draw(baked_grid, &cloth_mesh, &found, &picture)?;

    let deepest = found.contacts.iter().map(|contact| contact.distance).fold(0.0, f64::min);
    Report {
        rows: vec![
            ("body", format!("{}, {} triangles", body.display(), input.mesh.triangles.len())),
            ("cloth", format!("{}, {} triangles", cloth.display(), cloth_mesh.triangles.len())),
            ("field", format!("{}, {}", grid.display(), about.sign_verdict)),
            ("contacts", format!("{}, {} of them", list.display(), found.contacts.len())),
            ("deepest", number(deepest)),
            ("picture", picture.display().to_string()),
        ],
        json: json!({
            "schema": "sdftool.demo/1",
            "folder": folder.display().to_string(),
            "elements": found.elements,
            "passed_cull": found.passed_cull,
            "contacts": found.contacts.len(),
            "deepest": deepest,
        }),
    }
    .print(args.json)
}

struct Model {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// A ball with a spike in every direction of a finer ball's corners: radius about 0.6, spikes to 1.
fn spiky_body() -> Model {
    let mut ball = icosahedron();
    ball = refine(&refine(&ball));
    let mut body = Model { points: ball.points.iter().map(|p| p.map(|x| 0.6 * x)).collect(), triangles: Vec::new() };
    for (number, corners) in ball.triangles.iter().enumerate() {
        let [a, b, c] = *corners;
        if number % 4 != 3 {
            body.triangles.push(*corners);
            continue;
        }
        let center: [f64; 3] =
            std::array::from_fn(|axis| corners.iter().map(|corner| ball.points[*corner as usize][axis]).sum());
        let length = center.iter().map(|x| x * x).sum::<f64>().sqrt();
        let tip = body.points.len() as u32;
        body.points.push(center.map(|x| x / length));
        body.triangles.extend([[a, b, tip], [b, c, tip], [c, a, tip]]);
    }
    body
}

fn icosahedron() -> Model {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let length = (1.0 + golden * golden).sqrt();
    let mut points = Vec::new();
    for axis in 0..3 {
        for (short, long) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut point = [0.0; 3];
            (point[axis], point[(axis + 1) % 3]) = (short / length, long / length);
            points.push(point);
        }
    }
    // Neighbours are two lengths of the short side apart.
    let is_edge = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|index| points[index as usize]);
        (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>() < 1.2
    };
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
                    triangles.push(outward(&points, [a, b, c]));
                }
            }
        }
    }
    Model { points, triangles }
}

fn outward(points: &[[f64; 3]], [a, b, c]: [u32; 3]) -> [u32; 3] {
    use sdf_core::nalgebra::Vector3;
    let [p, q, r] = [a, b, c].map(|index| Vector3::from(points[index as usize]));
    if p.dot(&q.cross(&r)) < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Each triangle in four, the new corners on the unit ball; of every four the last is the middle one.
fn refine(ball: &Model) -> Model {
    let mut points = ball.points.clone();
    let mut middles = std::collections::BTreeMap::new();
    let mut triangles = Vec::new();
    for [a, b, c] in &ball.triangles {
        let mut middle = |from: u32, to: u32| {
            *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                let [p, q] = [from, to].map(|index| points[index as usize]);
                let sum: [f64; 3] = std::array::from_fn(|axis| p[axis] + q[axis]);
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                points.push(sum.map(|x| x / length));
                points.len() as u32 - 1
            })
        };
        let [ab, bc, ca] = [middle(*a, *b), middle(*b, *c), middle(*c, *a)];
        triangles.extend([[*a, ab, ca], [*b, bc, ab], [*c, ca, bc], [ab, bc, ca]]);
    }
    Model { points, triangles }
}

/// A square sheet that hangs over the body, a little too low for the spikes.
fn cloth_over_body() -> Model {
    const SIDE: u32 = 60;
    let mut points = Vec::new();
    for row in 0..=SIDE {
        for column in 0..=SIDE {
            let [x, y] = [column, row].map(|step| 2.4 * (f64::from(step) / f64::from(SIDE) - 0.5));
            let from_axis = x.hypot(y);
            points.push([x, y, (0.86 - 0.45 * from_axis * from_axis).max(-0.6)]);
        }
    }
    let mut triangles = Vec::new();
    for row in 0..SIDE {
        for column in 0..SIDE {
            let corner = row * (SIDE + 1) + column;
            let above = corner + SIDE + 1;
            triangles.extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
        }
    }
    Model { points, triangles }
}

/// A cut through the body's middle: the cloth as a green line, contacts as red dots.
fn draw<F: Sdf>(field: &F, cloth: &mesh::Mesh, found: &contacts::Found, path: &Path) -> Result<()> {
    const GREEN: [u8; 3] = [20, 130, 60];
    const RED: [u8; 3] = [200, 30, 40];
    let window = sdf_core::Aabb { min: [-1.25; 3], max: [1.25; 3] };
    let mut picture = Picture::of(field, Plane { axis: 1, at: 0.0, window }, 900, None);
    for corners in &cloth.triangles {
        let corners = corners.map(|corner| cloth.points[corner as usize]);
        if let [from, to] = cut(corners)[..] {
            picture.line(from, to, 1.2, GREEN);
        }
    }
    for contact in found.contacts.iter().filter(|contact| contact.point[1].abs() < DRAWN_WITHIN) {
        picture.dot(contact.point, 4.0, RED);
    }
    picture.write(path)
}

/// Where the plane y = 0 cuts a triangle's edges.
fn cut(corners: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
    let sides = [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end: usize| corners[end]));
    let crossing = |[from, to]: [[f64; 3]; 2]| {
        let share = from[1] / (from[1] - to[1]);
        ((from[1] <= 0.0) != (to[1] <= 0.0))
            .then(|| std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis])))
    };
    sides.into_iter().filter_map(crossing).collect()
}
