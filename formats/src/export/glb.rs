//! A triangle mesh as binary glTF 2.0 (Khronos, ISO/IEC 12113): one JSON chunk, one binary chunk, little-endian.

use sdf_core::Aabb;
use serde_json::json;

/// Kinds of elements, and what a view of the buffer holds, by the numbers that glTF took from OpenGL.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A mesh whose middle is farther from the origin than this many of its longest sides is written about its middle.
const FAR: f64 = 16.0;

/// One mesh with unit normals at its vertices, as many as points. glTF is f32: coordinates are rounded once. Far from the origin they are
/// those from the mesh's middle, to which the node has the translation.
pub fn glb(points: &[[f64; 3]], normals: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let translation = translation(points);
    let [x, y, z] = translation.unwrap_or_default();
    let points: Vec<[f32; 3]> =
        points.iter().map(|point| [point[0] - x, point[1] - y, point[2] - z].map(|x| x as f32)).collect();
    let node = translation.map_or(json!({"mesh": 0}), |translation| json!({"mesh": 0, "translation": translation}));
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
        "nodes": [node],
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

/// The middle of points that are far from the origin, in numbers of f32, which readers keep.
fn translation(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let bounds = Aabb::from_points(points.iter().copied())?;
    let middle = std::array::from_fn(|axis| f64::from((0.5 * bounds.min[axis] + 0.5 * bounds.max[axis]) as f32));
    let farthest = middle.iter().fold(0.0_f64, |farthest, x| farthest.max(x.abs()));
    (farthest > FAR * bounds.longest_side()).then_some(middle)
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    /// The JSON of a file, and its points.
    fn contents(file: &[u8]) -> (Value, Vec<[f32; 3]>) {
        let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        let document: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
        let count = document["accessors"][0]["count"].as_u64().unwrap() as usize;
        let numbers = file[28 + length..].as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        let numbers: Vec<f32> = numbers.take(3 * count).collect();
        (document, numbers.as_chunks().0.to_vec())
    }

    #[test]
    fn points_far_from_the_origin_keep_their_digits_and_near_ones_their_place() {
        let corners = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.003]];
        for (offset, is_far) in [(0.0, false), (0.1, false), (1.0, true), (-1e6, true), (1e30, true)] {
            let points = corners.map(|corner| corner.map(|x| x + offset));
            let (document, written) = contents(&glb(&points, &[[0.0, 0.0, 1.0]; 3], &[[0, 1, 2]]));
            let node = &document["nodes"][0];
            assert_eq!(node.get("translation").is_some(), is_far, "{offset}");
            let axis = |axis: usize| node["translation"][axis].as_f64().unwrap_or(0.0);
            for (point, written) in points.iter().zip(&written) {
                for k in 0..3 {
                    // f32 of a length of up to 16 sides, and half a step of f32 that the middle was rounded by.
                    let size = if is_far { 0.02 + f64::from(f32::EPSILON) * offset.abs() } else { 16.0 * 0.02 };
                    let error = (f64::from(written[k]) - (point[k] - axis(k))).abs();
                    assert!(error <= f64::from(f32::EPSILON) * size, "{offset}: {error}");
                }
            }
            let [least, greatest] =
                ["min", "max"].map(|name| document["accessors"][0][name][1].as_f64().unwrap() as f32);
            let ys = || written.iter().map(|point| point[1]);
            assert!(ys().all(|y| least <= y && y <= greatest) && ys().any(|y| y == greatest), "{offset}");
        }
    }
}
