//! Files that earlier versions of sdftool wrote are read as they were then. Made by `sdftool bake box.obj --res 8`, of a box from -1 to
//! 1, the sparse one with `--layout sparse --keep-mesh`, that of version 5 with `--precision u16`.

use sdf_core::Sdf;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_core::nalgebra::Vector3;
use sdf_formats::grid_file::{self, StoredGrid};

const DENSE_3: &[u8] = include_bytes!("../golden/version-3-dense.h5");
const SPARSE_3: &[u8] = include_bytes!("../golden/version-3-sparse.h5");

const DENSE_5: &[u8] = include_bytes!("../golden/version-5-dense-u16.h5");

/// The file of version 3, its chunks shuffled but not deflated: written again by h5py.
const SHUFFLED: &[u8] = include_bytes!("../golden/shuffled-dense.h5");

const POINTS: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [0.9, 0.2, -0.3], [1.1, 0.25, 0.5]];

fn values(stored: &StoredGrid) -> [f64; 3] {
    POINTS.map(|point| stored.grid.sample(Vector3::from(point)).value)
}

#[test]
fn files_of_version_3_have_the_values_that_they_had() {
    let dense = grid_file::read_bytes(DENSE_3, "dense").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(values(&dense), [-1.0, -0.10000000000000009, 0.10000000000000009]);
    assert_eq!(dense.about.error_bound, 0.21650655742265218);
    assert_eq!(dense.grid.storage().layout(), Layout::Dense);

    let sparse = grid_file::read_bytes(SPARSE_3, "sparse").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(values(&sparse), [-1.0, -0.10000609159469614, 0.10000426769256601]);
    assert_eq!(sparse.sparse.map(|sparse| (sparse.precision, sparse.bricks)), Some((Precision::U16, 20)));
    let mesh = sparse.mesh.unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.is_sign_continuous), (8, 12, true));
}

#[test]
fn chunks_that_are_shuffled_alone_are_read() {
    let [dense, shuffled] =
        [DENSE_3, SHUFFLED].map(|bytes| grid_file::read_bytes(bytes, "grid").unwrap_or_else(|error| panic!("{error}")));
    assert!(shuffled.grid == dense.grid && shuffled.about == dense.about);
}

#[test]
fn a_file_of_version_5_has_the_values_that_it_had() {
    let dense = grid_file::read_bytes(DENSE_5, "dense").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(values(&dense), [-0.9999837875366211, -0.0999839186668397, 0.10001413822174081]);
    let storage = dense.grid.storage();
    assert_eq!((storage.layout(), storage.precision(), dense.sparse), (Layout::Dense, Precision::U16, None));
}

/// Checked by SHA-256, as that version did.
#[test]
fn damage_in_files_of_version_3_is_noticed() {
    for bytes in [DENSE_3, SPARSE_3] {
        let whole = grid_file::read_bytes(bytes, "grid").unwrap();
        let mut noticed = 0;
        for at in (0..bytes.len()).step_by(7) {
            let mut damaged = bytes.to_vec();
            damaged[at] ^= 1 << (at % 8);
            match grid_file::read_bytes(&damaged, "grid") {
                Ok(StoredGrid { grid, about, mesh, .. }) => {
                    assert!(grid == whole.grid && about == whole.about && mesh == whole.mesh, "at {at}");
                }
                Err(error) => {
                    assert_eq!(error.to_string().lines().count(), 1, "{error}");
                    noticed += 1;
                }
            }
        }
        // The rest is room that HDF5 leaves.
        println!("{noticed} of {}", bytes.len() / 7);
        assert!(noticed > 300, "{noticed}");
    }
}
