//! A triangle mesh as binary glTF 2.0 (Khronos, ISO/IEC 12113): one JSON chunk, one binary chunk, little-endian.

use serde_json::json;

/// Kinds of elements, and what a view of the buffer holds, by the numbers that glTF took from OpenGL.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// One mesh with unit normals at its vertices, as many as points. glTF is f32: coordinates are rounded once.
pub fn glb(points: &[[f64; 3]], normals: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let points: Vec<[f32; 3]> = points.iter().map(|point| point.map(|x| x as f32)).collect();
    let extremes = |start: f32, pick: fn(f32, f32) -> f32| {
        points.iter().fold([start; 3], |found, point| std::array::from_fn(|axis| pick(found[axis], point[axis])))
    };
    let mut binary = Vec::with_capacity(24 * points.len() + 12 * triangles.len());
    binary.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    binary.extend(normals.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
    binary.extend(triangles.iter().flatten().flat_map(|index| index.to_le_bytes()));
    let [vectors, indices] = [12 * points.len(), 12 * triangles.len()];
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("sdftool ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": points.len(), "type": "VEC3",
             "min": extremes(f32::INFINITY, f32::min), "max": extremes(f32::NEG_INFINITY, f32::max)},
            {"bufferView": 1, "componentType": FLOAT, "count": normals.len(), "type": "VEC3"},
            {"bufferView": 2, "componentType": UNSIGNED_INT, "count": 3 * triangles.len(), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": vectors, "target": ARRAY_BUFFER},
            {"buffer": 0, "byteOffset": vectors, "byteLength": vectors, "target": ARRAY_BUFFER},
            {"buffer": 0, "byteOffset": 2 * vectors, "byteLength": indices, "target": ELEMENT_ARRAY_BUFFER},
        ],
        "buffers": [{"byteLength": binary.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut bytes = Vec::with_capacity(total);
    bytes.extend(b"glTF");
    [2, total as u32, text.len() as u32].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}
