//! Scenes as text files say them: a field, and a mesh that touches it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use sdf_core::nalgebra::{Rotation3, Vector3};
use sdf_formats::field_file::{self, Field, Node};
use serde::{Deserialize, Serialize};

use super::fields::{self, Layout};
use crate::mesh_input;
use crate::models::{Bowl, Model, Pot, Rope, Sheet, SpikedBall};

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub name: String,
    pub about: String,
    pub elements: Elements,
    pub margin: f64,
    body: Body,
    /// Of a body that is a mesh.
    pub grid: Option<GridOptions>,
    mesh: Touching,
    pub paper: Option<Paper>,
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
    pub layout: Layout,
}

/// What the field is of.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Body {
    SpikedBall(SpikedBall),
    Bowl(Bowl),
    Pot(Pot),
    /// A baked grid, shapes in closed form, or a mesh to bake, seen from the folder of the scene.
    File(String),
}

/// What touches it.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Touching {
    Sheet(Sheet),
    Rope(Rope),
    Bowls(Bowls),
    /// A mesh, seen from the folder of the scene.
    File(String),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bowls {
    bowl: Bowl,
    places: Vec<Pose>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    shift: [f64; 3],
    /// About the x axis, before the shift.
    turn_deg: f64,
}

/// Table 1, in microseconds on the paper's graphics processor.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    pub simple: f64,
    pub projected_gradient: f64,
    pub frank_wolfe: f64,
    pub golden_section: Option<f64>,
}

/// The scenes of the paper's table 1, as the installed program has them.
const SCENES: [&str; 6] = [
    include_str!("../../../scenes/dragon.toml"),
    include_str!("../../../scenes/net.toml"),
    include_str!("../../../scenes/teapot.toml"),
    include_str!("../../../scenes/shells.toml"),
    include_str!("../../../scenes/rope.toml"),
    include_str!("../../../scenes/analytic.toml"),
];

/// The one field that they name.
const ANALYTIC: (&str, &str) = ("analytic.sdf.toml", include_str!("../../../scenes/analytic.sdf.toml"));

/// The program's own, then those of the files.
pub fn all(files: &[PathBuf]) -> Result<Vec<Place>> {
    let own = SCENES.into_iter().map(|text| Ok(Place { scene: parse(text)?, folder: None }));
    let from_file = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let scene = parse(&text).with_context(|| path.display().to_string())?;
        Ok(Place { scene, folder: Some(path.parent().unwrap_or(Path::new("")).to_owned()) })
    };
    own.chain(files.iter().map(from_file)).collect()
}

fn parse(text: &str) -> Result<Scene> {
    // The parser's own message has several lines.
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        anyhow::anyhow!("line {line}: {}", error.message())
    })
}

/// A scene, and where its files are looked for.
pub struct Place {
    pub scene: Scene,
    /// `None` of the program's own.
    folder: Option<PathBuf>,
}

impl Place {
    /// Bakes where the body is a mesh, with at most so many cells along its side.
    pub fn field(&self, most_cells: u32) -> Result<Node> {
        let model = match &self.scene.body {
            Body::SpikedBall(body) => body.model(),
            Body::Bowl(body) => body.model(),
            Body::Pot(body) => body.model(),
            Body::File(name) => match (&self.folder, self.scene.grid) {
                (None, _) => return Ok(field_file::read_text(ANALYTIC.1, ANALYTIC.0)?),
                (Some(folder), Some(_)) => model_of_file(&folder.join(name))?,
                (Some(folder), None) => return field_of_file(&folder.join(name)),
            },
        };
        let grid = self.scene.grid.with_context(|| format!("scene {}: needs a grid to bake into", self.scene.name))?;
        fields::bake(&model, grid.resolution.min(most_cells), grid.layout)
    }

    pub fn mesh(&self) -> Result<Model> {
        Ok(match &self.scene.mesh {
            Touching::Sheet(sheet) => sheet.model(),
            Touching::Rope(rope) => rope.model(),
            Touching::Bowls(bowls) => bowls.model(),
            Touching::File(name) => match &self.folder {
                Some(folder) => model_of_file(&folder.join(name))?,
                None => bail!("scene {}: has no folder", self.scene.name),
            },
        })
    }

    /// Bodies that are the same are baked once.
    pub fn shares_field_with(&self, other: &Self) -> bool {
        self.folder == other.folder && self.scene.body == other.scene.body && self.scene.grid == other.scene.grid
    }
}

fn field_of_file(path: &Path) -> Result<Node> {
    Ok(match field_file::read(path)? {
        Field::Grid(stored) => Node::Grid(Arc::new(stored.grid)),
        Field::Analytic(node) => node,
    })
}

fn model_of_file(path: &Path) -> Result<Model> {
    let mesh = mesh_input::read_mesh(path)?;
    let segments = mesh.edges();
    Ok(Model { points: mesh.points, triangles: mesh.triangles, segments })
}

impl Bowls {
    fn model(&self) -> Model {
        let bowl = self.bowl.model();
        let mut all = Model::default();
        for pose in &self.places {
            let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), pose.turn_deg.to_radians());
            let place = |point| (turn * Vector3::from(point) + Vector3::from(pose.shift)).into();
            all.join(&bowl.clone().moved(place));
        }
        all
    }
}
