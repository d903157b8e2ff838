//! Fields saved and opened again. That closed forms keep their bits is a law of `sdf-formats`.

use std::path::PathBuf;

use sdf_field::core::combine::Shell;
use sdf_field::core::grid::owned::{OwnedGrid, OwnedStorage};
use sdf_field::core::grid::{BlockBounds, Lattice};
use sdf_field::core::shapes::{Cone, Sphere};
use sdf_field::core::{AnyField, placed::Similarity};
use sdf_field::file::SaveError;
use sdf_field::{Field, Threads};

const POINTS: [[f64; 3]; 3] = [[0.1, 0.2, 0.3], [-1.5, 0.7, 0.0], [3.0, -2.0, 1.0]];

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn grid() -> AnyField {
    let lattice = Lattice::new([0.0; 3], 1.0, [2; 3]).unwrap();
    let storage = OwnedStorage::dense(&lattice, vec![1.0; 8], vec![BlockBounds::EMPTY]);
    OwnedGrid::new(lattice, storage.unwrap(), 1.0).unwrap().into()
}

#[test]
fn a_closed_form_is_saved_as_text() {
    let cone = AnyField::from(Cone::new(0.2, 1.0).unwrap());
    let placed = cone.placed(Similarity::new([1.0, 2.0, 3.0], [0.1, 0.2, 0.3, 1.0], 2.0).unwrap());
    let field = Field::new(AnyField::Shell(Box::new(Shell::new(placed, 0.1).unwrap())));
    field.save(path("shell.sdf.toml")).unwrap();
    let bytes = field.to_bytes().unwrap();
    assert_eq!(std::fs::read(path("shell.sdf.toml")).unwrap(), bytes);
    for again in [Field::open(path("shell.sdf.toml")).unwrap(), Field::from_bytes(&bytes, "shell").unwrap()] {
        assert_eq!(again.sample(&POINTS, Threads::ONE), field.sample(&POINTS, Threads::ONE));
    }
}

#[test]
fn what_cannot_be_saved_says_why() {
    let alone = Field::new(grid()).to_bytes().unwrap_err();
    assert!(matches!(alone, SaveError::NotABakedGrid) && alone.to_string().contains("Field::from_grid"), "{alone}");
    let parts = vec![Sphere::new(1.0).unwrap().into(), grid()];
    let inside = Field::new(AnyField::union(parts).unwrap()).save(path("union.sdf.toml")).unwrap_err().to_string();
    assert!(inside.contains("union.sdf.toml: field.of[1]: a grid cannot be written in TOML"), "{inside}");
}
