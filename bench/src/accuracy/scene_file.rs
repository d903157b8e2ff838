//! Scenes as TOML files describe them: a field, and a mesh that touches it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdf_core::AnyField;
use sdf_core::grid::owned::Layout;
use sdf_core::nalgebra::{Rotation3, Vector3};
use sdf_field::Field;
use sdf_formats::{field_file, mesh};
use sdf_procedural::{Bowl, Mesh, Pot, Rope, Sheet, SpikedBall};
use serde::{Deserialize, Serialize};

use super::fields;

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub name: String,
    pub about: String,
    pub elements: Elements,
    pub margin: f64,
    body: Body,
    /// Grid of a body that is a mesh.
    pub grid: Option<GridOptions>,
    mesh: TouchingMesh,
    pub paper: Option<PaperTimes>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Elements {
    Faces,
    Edges,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GridOptions {
    /// Cells along the body's longest side.
    pub resolution: u32,
    #[serde(deserialize_with = "layout")]
    pub layout: Layout,
}

fn layout<'de, D: serde::Deserializer<'de>>(text: D) -> Result<Layout, D::Error> {
    let name = String::deserialize(text)?;
    Layout::from_name(&name).ok_or_else(|| serde::de::Error::unknown_variant(&name, &["dense", "sparse"]))
}

/// Source of the field.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Body {
    SpikedBall(SpikedBall),
    Bowl(Bowl),
    Pot(Pot),
    /// A baked grid, shapes in closed form, or a mesh to bake, relative to the folder of the scene.
    File(String),
}

/// Source of the mesh that touches the body.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum TouchingMesh {
    Sheet(Sheet),
    Rope(Rope),
    Bowls(Bowls),
    /// A mesh file, relative to the folder of the scene.
    File(String),
}

/// Copies of one bowl.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bowls {
    bowl: Bowl,
    #[serde(rename = "places")]
    poses: Vec<Pose>,
}

/// A rotation about the x axis, then a translation.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    #[serde(rename = "shift")]
    translation: [f64; 3],
    #[serde(rename = "turn_deg")]
    rotation_deg: f64,
}

/// Times of the paper's table 1, in microseconds on its graphics processor.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PaperTimes {
    pub simple: f64,
    pub projected_gradient: f64,
    pub frank_wolfe: f64,
    pub golden_section: Option<f64>,
}

/// The scenes of the paper's table 1.
const SCENES: [&str; 6] = [
    include_str!("../../scenes/dragon.toml"),
    include_str!("../../scenes/net.toml"),
    include_str!("../../scenes/teapot.toml"),
    include_str!("../../scenes/shells.toml"),
    include_str!("../../scenes/rope.toml"),
    include_str!("../../scenes/analytic.toml"),
];

/// The one field file that [`SCENES`] name.
const ANALYTIC: (&str, &str) = ("analytic.sdf.toml", include_str!("../../scenes/analytic.sdf.toml"));

/// The built-in scenes, then those of the files.
pub fn read_scenes(files: &[PathBuf]) -> Result<Vec<SceneFile>> {
    let built_in = SCENES.into_iter().map(|text| Ok(SceneFile { scene: parse(text)?, folder: None }));
    let read = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let scene = parse(&text).with_context(|| path.display().to_string())?;
        Ok(SceneFile { scene, folder: Some(path.parent().unwrap_or(Path::new("")).to_owned()) })
    };
    built_in.chain(files.iter().map(read)).collect()
}

fn parse(text: &str) -> Result<Scene> {
    // The parser's own message has several lines.
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        anyhow::anyhow!("line {line}: {}", error.message())
    })
}

/// A scene, and the folder that its file names are relative to.
pub struct SceneFile {
    pub scene: Scene,
    /// `None` for built-in scenes.
    folder: Option<PathBuf>,
}

impl SceneFile {
    /// The field, baked if the body is a mesh, with at most `max_cells` cells along its longest side.
    pub fn field(&self, max_cells: u32) -> Result<AnyField> {
        let Some(body) = self.body()? else {
            return match (&self.scene.body, &self.folder) {
                (Body::File(name), Some(folder)) => read_field(&folder.join(name)),
                _ => Ok(field_file::read_text(ANALYTIC.1, ANALYTIC.0)?),
            };
        };
        let grid = self.scene.grid.with_context(|| format!("scene {}: needs a grid to bake into", self.scene.name))?;
        fields::bake(&body, grid.resolution.min(max_cells), grid.layout)
    }

    /// The mesh that the field is baked from; `None` if a file has the field itself.
    pub fn body(&self) -> Result<Option<Mesh>> {
        Ok(match &self.scene.body {
            Body::SpikedBall(body) => Some(body.mesh()),
            Body::Bowl(body) => Some(body.mesh()),
            Body::Pot(body) => Some(body.mesh()),
            Body::File(name) => match (&self.folder, self.scene.grid) {
                (Some(folder), Some(_)) => Some(read_mesh(&folder.join(name))?),
                _ => None,
            },
        })
    }

    pub fn mesh(&self) -> Result<Mesh> {
        Ok(match &self.scene.mesh {
            TouchingMesh::Sheet(sheet) => sheet.mesh(),
            TouchingMesh::Rope(rope) => rope.mesh(),
            TouchingMesh::Bowls(bowls) => bowls.mesh(),
            TouchingMesh::File(name) => match &self.folder {
                Some(folder) => read_mesh(&folder.join(name))?,
                None => bail!("scene {}: has no folder", self.scene.name),
            },
        })
    }

    pub fn shares_field_with(&self, other: &Self) -> bool {
        self.folder == other.folder && self.scene.body == other.scene.body && self.scene.grid == other.scene.grid
    }
}

fn read_field(path: &Path) -> Result<AnyField> {
    Ok(Field::open(path)?.into_any())
}

fn read_mesh(path: &Path) -> Result<Mesh> {
    let mesh = mesh::read(path)?;
    let segments = mesh.edges();
    Ok(Mesh { points: mesh.points, triangles: mesh.triangles, segments })
}

impl Bowls {
    fn mesh(&self) -> Mesh {
        let bowl = self.bowl.mesh();
        let mut bowls = Mesh::default();
        for pose in &self.poses {
            let rotation = Rotation3::from_axis_angle(&Vector3::x_axis(), pose.rotation_deg.to_radians());
            let map = |point| (rotation * Vector3::from(point) + Vector3::from(pose.translation)).into();
            bowls.append(&bowl.clone().transformed(map));
        }
        bowls
    }
}
