//! Pictures agree with the field.

use std::io::Cursor;

use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_formats::field_file::{self, Field};
use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

struct Png {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

fn decode(bytes: &[u8]) -> Png {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut buffer).unwrap();
    assert_eq!((frame.color_type, frame.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    let pixels = buffer[..frame.buffer_size()].as_chunks::<3>().0.to_vec();
    Png { width: frame.width as usize, height: frame.height as usize, pixels }
}

/// The pixels of a PNG, row by row.
pub fn pixels(png: &[u8]) -> Vec<[u8; 3]> {
    decode(png).pixels
}

/// A field that looks different along each axis.
const LOPSIDED: &str = "[field]\nshape = \"union\"\n\
    of = [{ shape = \"sphere\", radius = 1.0 }, { shape = \"box\", half_extents = [0.2, 0.3, 0.1], \
    pose.translation = [1.5, 0.9, 0.7] }]\n";

#[test]
fn a_slice_is_black_on_the_surface_blue_inside_and_orange_outside() {
    let folder = Folder::new();
    folder.write("field.sdf.toml", LOPSIDED);
    let Field::Analytic(field) = field_file::read(&folder.at("field.sdf.toml")).unwrap() else { panic!("shapes") };
    for (axis, [right, up], words) in
        [(0, [1, 2], "--axis x --at 0.1"), (1, [0, 2], "--axis y"), (2, [0, 1], "--axis z --at -0.25")]
    {
        let json = folder.json(&format!("slice field.sdf.toml -o slice.png --pixels 300 {words}"));
        assert_eq!(json["schema"], "sdftool.slice/1");
        let corner = |name: &str| -> [f64; 3] { std::array::from_fn(|k| json["window"][name][k].as_f64().unwrap()) };
        let (min, max) = (corner("min"), corner("max"));
        let png = decode(&folder.read("slice.png"));
        assert_eq!(json["pixels"], Value::from(vec![png.width, png.height]));
        assert_eq!(png.width.max(png.height), 300);
        let pixel = (max[right] - min[right]).max(max[up] - min[up]) / 300.0;
        let mut seen = [0; 3];
        for row in 0..png.height {
            for column in 0..png.width {
                let mut point = [json["at"].as_f64().unwrap(); 3];
                point[right] = min[right] + (column as f64 + 0.5) * pixel;
                point[up] = min[up] + ((png.height - row) as f64 - 0.5) * pixel;
                let sample = field.sample(Vector3::from(point));
                let slope = sample.gradient[right].hypot(sample.gradient[up]).max(0.1);
                let distance = sample.value / slope / pixel;
                let [red, green, blue] = png.pixels[row * png.width + column];
                match distance {
                    _ if distance.abs() < 0.99 => assert_eq!([red, green, blue], [0; 3], "{point:?}"),
                    _ if distance.abs() < 2.01 => continue,
                    _ if distance < 0.0 => assert!(blue > red, "{point:?} is inside: {red} {green} {blue}"),
                    _ => assert!(red > blue, "{point:?} is outside: {red} {green} {blue}"),
                }
                seen[usize::from(distance >= 0.99) + usize::from(distance > -0.99)] += 1;
            }
        }
        assert!(seen.iter().all(|count| *count > 100), "axis {axis}: {seen:?}");
    }
}

#[test]
fn a_slice_of_a_grid_shows_its_box_and_reports_its_window() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.done("bake ball.obj --res 16");
    says(&folder.done("slice ball.sdf.h5 -o ball.png --pixels 64"), &["z = 0.000000", "ball.png, 64 × 64 pixels"]);
    let png = decode(&folder.read("ball.png"));
    assert_eq!([png.width, png.height], [64, 64]);
    assert!(png.pixels.contains(&[0; 3]));
    folder.wrong_usage("slice ball.sdf.h5 -o ball.png --pixels 4");
    folder.wrong_usage("slice ball.sdf.h5");
    folder.write("plane.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [1, 0, 0]\noffset = 0\n");
    says(&folder.refused("slice plane.sdf.toml -o plane.png"), &["plane.sdf.toml", "unbounded", "intersect"]);
}

#[test]
fn the_picture_of_the_demo_shows_contacts_in_red_on_the_cloth_in_green() {
    let folder = Folder::new();
    folder.done("demo -o demo");
    let png = decode(&folder.read("demo/contacts.png"));
    let count = |color: [u8; 3]| png.pixels.iter().filter(|pixel| **pixel == color).count();
    assert!(count([200, 30, 40]) > 100, "red dots");
    assert!(count([20, 130, 60]) > 500, "a green line");
    assert!(count([0; 3]) > 500, "a black surface");
    // Every contact has a dot: pixels of 2.5 / 900 from the corner (-1.25, 1.25) of x and z.
    let list = String::from_utf8(folder.read("demo/contacts.csv")).unwrap();
    let names: Vec<&str> = list.lines().next().unwrap().split(',').collect();
    let near_plane = list.lines().skip(1).filter_map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |name: &str| cells[names.iter().position(|known| *known == name).unwrap()].parse::<f64>().unwrap();
        (cell("y").abs() < 0.03).then(|| [cell("x"), cell("z")])
    });
    let mut dots = 0;
    for [x, z] in near_plane {
        let [column, row] = [(x + 1.25) * 360.0, (1.25 - z) * 360.0].map(|x| x as usize);
        // Another dot's white outline may cover it.
        assert!([[200, 30, 40], [255; 3]].contains(&png.pixels[row * png.width + column]), "{x} {z}");
        dots += 1;
    }
    assert!(dots > 3);
}

#[test]
fn the_ends_that_a_refusal_names_are_taken() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.1, 0.2, 0.3], 1.0 / 3.0, 2).obj());
    folder.done("bake ball.obj --res 13");
    let line = folder.refused("slice ball.sdf.h5 -o s.png --at 9");
    let (_, ends) = line.split_once("use z from ").unwrap();
    for end in ends.split(" to ") {
        folder.done(&format!("slice ball.sdf.h5 -o s.png --pixels 16 --at {end}"));
    }
}
