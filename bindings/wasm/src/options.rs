//! Which words stand for which option? Those of the program and of Python, in the spelling of JavaScript.

use sdf_field::core::contact::Reduction;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::placed::Rigid;
use sdf_field::{
    BakeOptions, ContactOptions, Elements, GridSize, InnerFaces, MaxError, Method, SignMethod, Source, Threads,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

/// Options by their names. Each is read alone first, so that an error names it.
pub fn read<T: DeserializeOwned>(options: Map<String, Value>) -> Result<T, String> {
    for (name, value) in &options {
        serde_json::from_value::<T>(json!({(name): value})).map_err(|error| format!("{name}: {error}"))?;
    }
    serde_json::from_value(Value::Object(options)).map_err(|error| error.to_string())
}

/// How a mesh is baked.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
pub struct BakeWords {
    res: Option<u32>,
    voxel_size: Option<f64>,
    max_error: Option<ErrorWords>,
    layout: Option<String>,
    precision: Option<String>,
    sign: Option<String>,
    band: Option<u32>,
    padding: Option<u32>,
    inner_faces: Option<String>,
    keep_mesh: bool,
    weld: Option<f64>,
    close: Option<f64>,
    source: SourceWords,
}

/// A length, or text such as `0.1%` of the diagonal.
#[derive(Deserialize)]
#[serde(untagged, expecting = "give a positive length, or text such as \"0.1%\" of the diagonal")]
enum ErrorWords {
    Length(f64),
    Percent(String),
}

/// The file that a mesh was read from.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "an object with name and sha256")]
struct SourceWords {
    name: String,
    /// In hexadecimal digits.
    sha256: String,
}

/// How contacts are searched.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
pub struct ContactWords {
    margin: f64,
    method: Option<String>,
    elements: Option<String>,
    pose: Option<PoseWords>,
    budget: Option<u32>,
    tolerance: Option<f64>,
    all_minima: bool,
    complete: bool,
    exact: bool,
    one_per_feature: bool,
    lean: bool,
    reduce: Option<ReduceWords>,
}

/// How few contacts of a rigid body are kept.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with count and movement")]
struct ReduceWords {
    count: u32,
    movement: f64,
    #[serde(default)]
    thickness: f64,
}

/// Where the field stands: turned by a quaternion x, y, z, w, then moved.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with translation and rotation")]
struct PoseWords {
    #[serde(default)]
    translation: [f64; 3],
    #[serde(default = "identity")]
    rotation: [f64; 4],
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

impl BakeWords {
    pub fn to_rust(&self, triangles: usize) -> Result<BakeOptions, String> {
        let default = BakeOptions::default();
        let layouts = Layout::ALL.map(|layout| (layout.name(), layout));
        let layout = self.layout.as_deref().map(|name| choice("layout", name, &layouts)).transpose()?;
        let precisions = Precision::ALL.map(|precision| (precision.name(), precision));
        let precision = self.precision.as_deref().map(|name| choice("precision", name, &precisions)).transpose()?;
        let options = BakeOptions {
            size: self.size()?,
            layout: layout.unwrap_or(if self.max_error.is_some() { Layout::Sparse } else { Layout::Dense }),
            precision,
            band: self.band.unwrap_or(default.band),
            padding: self.padding.unwrap_or(default.padding),
            sign: self.sign.as_deref().map_or(Ok(None), |name| choice("sign", name, &SIGNS))?,
            inner_faces: match self.inner_faces.as_deref() {
                None => default.inner_faces,
                Some(name) => choice("innerFaces", name, &INNER_FACES)?,
            },
            keep_mesh: self.keep_mesh,
            weld: self.weld,
            close: self.close,
            threads: Threads::ALL,
            source: self.source.to_rust(triangles)?,
            ..default
        };
        if self.max_error.is_some() && (layout == Some(Layout::Dense) || precision.is_some()) {
            return Err("maxError: layout and precision are chosen by the error; leave them out".to_owned());
        }
        Ok(options)
    }

    fn size(&self) -> Result<GridSize, String> {
        Ok(match (self.res, self.voxel_size, &self.max_error) {
            (Some(0), ..) => return Err("res: give 1 cell or more".to_owned()),
            (Some(cells), None, None) => GridSize::Cells(cells),
            (None, Some(size), None) if is_length(size) => GridSize::VoxelSize(size),
            (None, Some(size), None) => return Err(format!("voxelSize {size}: give a positive length")),
            (None, None, Some(error)) => GridSize::MaxError(error.to_rust()?),
            (None, None, None) => BakeOptions::default().size,
            _ => return Err("res, voxelSize and maxError: give one of them".to_owned()),
        })
    }
}

const SIGNS: [(&str, Option<SignMethod>); 3] =
    [("auto", None), ("pseudo-normal", Some(SignMethod::PseudoNormal)), ("winding", Some(SignMethod::Winding))];

const INNER_FACES: [(&str, InnerFaces); 2] = [("drop", InnerFaces::Drop), ("keep", InnerFaces::Keep)];

const ELEMENTS: [(&str, Elements); 3] =
    [("faces", Elements::Faces), ("edges", Elements::Edges), ("vertices", Elements::Vertices)];

const METHODS: [(&str, Method); 6] = [
    ("auto", Method::Auto),
    ("certified", Method::Certified),
    ("fw", Method::FrankWolfe),
    ("pgd", Method::ProjectedGradient),
    ("newton", Method::Newton),
    ("gss", Method::GoldenSection),
];

fn is_length(length: f64) -> bool {
    length > 0.0 && length.is_finite()
}

impl ErrorWords {
    fn to_rust(&self) -> Result<MaxError, String> {
        let error = match self {
            Self::Length(length) => Some(MaxError::Length(*length)).filter(|_| is_length(*length)),
            Self::Percent(text) => {
                let percent = text.strip_suffix('%').and_then(|text| text.trim().parse::<f64>().ok());
                percent.filter(|percent| is_length(*percent)).map(|percent| MaxError::Fraction(percent / 100.0))
            }
        };
        error.ok_or_else(|| "maxError: give a positive length, or text such as \"0.1%\" of the diagonal".to_owned())
    }
}

impl SourceWords {
    fn to_rust(&self, triangles: usize) -> Result<Source, String> {
        let mut sha256 = [0; 32];
        if !self.sha256.is_empty() {
            let digits: Option<Vec<u32>> = self.sha256.chars().map(|digit| digit.to_digit(16)).collect();
            let digits = digits.filter(|digits| digits.len() == 64);
            let digits = digits.ok_or("source.sha256: give 64 hexadecimal digits")?;
            for (byte, [high, low]) in sha256.iter_mut().zip(digits.as_chunks().0) {
                *byte = (16 * high + low) as u8;
            }
        }
        Ok(Source { name: self.name.clone(), sha256, triangles: triangles as u64 })
    }
}

impl ContactWords {
    pub fn to_rust(&self) -> Result<ContactOptions, String> {
        let default = ContactOptions::default();
        let tolerance = self.tolerance.unwrap_or(default.tolerance);
        if !is_length(tolerance) {
            return Err(format!("tolerance {tolerance}: give a positive number"));
        }
        let pose = self.pose.as_ref().map(|pose| {
            let rigid = Rigid::new(pose.translation, pose.rotation);
            rigid.ok_or_else(|| "pose: a zero quaternion is not a rotation, and numbers must be finite".to_owned())
        });
        Ok(ContactOptions {
            elements: match self.elements.as_deref() {
                None => default.elements,
                Some(name) => choice("elements", name, &ELEMENTS)?,
            },
            method: match self.method.as_deref() {
                None => default.method,
                Some(name) => choice("method", name, &METHODS)?,
            },
            margin: self.margin,
            pose: pose.transpose()?,
            budget: self.budget,
            tolerance,
            all_minima: self.all_minima,
            complete: self.complete,
            exact: self.exact,
            one_per_feature: self.one_per_feature,
            lean: self.lean,
            threads: Threads::ONE,
        })
    }

    pub fn reduction(&self) -> Option<Reduction<f64>> {
        let ReduceWords { count, movement, thickness } = *self.reduce.as_ref()?;
        Some(Reduction { count: count as usize, movement, thickness })
    }
}

/// The choice with this name, or an error that lists all.
fn choice<T: Copy>(what: &str, name: &str, choices: &[(&str, T)]) -> Result<T, String> {
    let found = choices.iter().find(|(known, _)| *known == name).map(|(_, choice)| *choice);
    found.ok_or_else(|| {
        let known: Vec<&str> = choices.iter().map(|(known, _)| *known).collect();
        format!("{what} {name:?} is unknown: give one of {}", known.join(", "))
    })
}
