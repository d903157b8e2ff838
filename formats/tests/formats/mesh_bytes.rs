//! Meshes as bytes: written and read as files are.

use std::fs;

use sdf_formats::mesh::{self, MeshFormat};
use tempfile::TempDir;

use crate::mesh_models::Model;
use crate::random::Random;

#[test]
fn bytes_and_files_are_the_same() {
    let folder = TempDir::new().unwrap();
    let model = Model::random(&mut Random::new(5), 40, 90, 3);
    let triangles: Vec<[u32; 3]> = model.polygons.iter().map(|polygon| [polygon[0], polygon[1], polygon[2]]).collect();
    for (format, name) in [(MeshFormat::Obj, "a.obj"), (MeshFormat::Ply, "a.ply"), (MeshFormat::Stl, "a.stl")] {
        let path = folder.path().join(name);
        assert_eq!(MeshFormat::from_extension(&path), Some(format));
        mesh::write(&path, format, &model.points, &triangles).unwrap();
        let bytes = mesh::to_bytes(format, &model.points, &triangles).unwrap();
        assert!(bytes == fs::read(&path).unwrap(), "{name}");
        // The content decides the format, not the name.
        let mesh = mesh::read_bytes(&bytes, "upload").unwrap();
        assert!(mesh == mesh::read(&path).unwrap() && mesh.format == format, "{name}");
    }
}
