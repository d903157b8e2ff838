//! Samples as plain arrays: raw with a description, NumPy (format 1.0 of numpy.lib.format), NRRD (teem's format 4).
//!
//! All hold little-endian f32, x fastest, one for each node; negative inside.

use sdf_core::grid::Lattice;
use serde_json::json;

/// Facts about a grid that a raw file's description states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawFacts {
    /// Certified bound of |value − distance|; `None` where nothing is certified.
    pub error_bound: Option<f64>,
    /// Lipschitz constant of the interpolated value.
    pub slope_bound: f64,
    /// Half width of the band in which values are distances; `None` where all are.
    pub band: Option<f64>,
    /// The mesh, if it is known.
    pub source: Option<String>,
}

/// The samples alone.
pub fn raw(samples: &[f32]) -> Vec<u8> {
    behind(Vec::new(), samples)
}

/// The samples behind a header.
fn behind(mut bytes: Vec<u8>, samples: &[f32]) -> Vec<u8> {
    bytes.reserve_exact(size_of_val(samples));
    bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
    bytes
}

/// The JSON text that describes the raw file `name`.
pub fn raw_description(name: &str, lattice: &Lattice, facts: &RawFacts) -> String {
    let description = json!({
        "schema": "sdftool.raw/1",
        "file": name,
        "type": "float32",
        "byte_order": "little",
        "order": "x fastest, then y, then z",
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "sign": "negative inside",
        "slope_bound": facts.slope_bound,
        "error_bound": facts.error_bound,
        "band": facts.band,
        "source": facts.source,
    });
    format!("{description:#}\n")
}

/// A NumPy array of shape (z, y, x).
pub fn npy(lattice: &Lattice, samples: &[f32]) -> Vec<u8> {
    let [nx, ny, nz] = lattice.nodes();
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({nz}, {ny}, {nx}), }}");
    // Magic, version, length and header are a multiple of 64 together; the header ends in a line feed.
    let before = NPY_MAGIC.len() + 4;
    header.push_str(&" ".repeat(63 - (before + header.len()) % 64));
    header.push('\n');
    let mut bytes = NPY_MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.into_bytes());
    behind(bytes, samples)
}

/// First bytes of every NumPy file.
pub(crate) const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// NRRD with its samples attached.
pub fn nrrd(lattice: &Lattice, samples: &[f32]) -> Vec<u8> {
    let ([nx, ny, nz], [x, y, z], h) = (lattice.nodes(), lattice.origin(), lattice.spacing());
    let header = format!(
        "NRRD0004\n# Signed distances, negative inside.\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: {nx} {ny} {nz}\n\
         space directions: ({h:?},0,0) (0,{h:?},0) (0,0,{h:?})\nkinds: domain domain domain\nendian: little\nencoding: raw\n\
         space origin: ({x:?},{y:?},{z:?})\n\n"
    );
    behind(header.into_bytes(), samples)
}
