//! A mesh becomes a field: bake it, read what is known of it, sample it, and keep it.

use sdf_field::core::Sdf;
use sdf_field::core::shapes::Octahedron;
use sdf_field::{BakeOptions, Field, GridSize, MeshView, Threads};

/// An octahedron: six corners, eight faces, counter-clockwise from outside.
pub const POINTS: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
pub const FACES: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = MeshView { points: &POINTS, faces: &FACES };
    // 48 cells along the longest side. `GridSize::MaxError` picks the size by the error instead.
    let options = BakeOptions { size: GridSize::Cells(48), ..BakeOptions::default() };
    let baked = Field::bake(mesh, &options)?;

    let field = baked.field;
    let info = field.info().ok_or("a baked field has its GridInfo")?;
    println!("inside and outside by: {}, {}", info.sign_method.name(), info.sign_reason);
    println!("certified error:       {:.5}", info.error_bound);

    // Negative inside, in the mesh's unit. This shape has a closed form to compare with.
    let exact = Octahedron::new(1.0).ok_or("a length")?;
    let points = [[0.0, 0.0, 0.0], [0.2, 0.3, 0.1], [0.9, 0.1, 0.0], [1.0, 0.05, 0.05]];
    for (point, sample) in points.iter().zip(field.sample(&points, Threads::ALL)) {
        let truth = exact.value((*point).into());
        println!("φ{point:?} = {:.5}, exact {truth:.5}", sample.value);
        assert!((sample.value - truth).abs() <= info.error_bound);
    }

    // `save` and `open` do the same with a file, octahedron.sdf.h5.
    let bytes = field.to_bytes()?;
    let again = Field::from_bytes(&bytes, "octahedron")?;
    println!("{} bytes as HDF5", bytes.len());
    assert_eq!(again.sample(&points, Threads::ONE), field.sample(&points, Threads::ONE));

    // A closed form is a text that a person can edit.
    let text = String::from_utf8(Field::new(exact).to_bytes()?)?;
    println!("and in closed form:\n{text}");
    assert_eq!(text, "[field]\nshape = \"octahedron\"\nsize = 1.0\n");
    Ok(())
}
