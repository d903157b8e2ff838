//! From a scene's description to a world, surfaces and obstacles.

use std::path::Path;
use std::sync::Arc;

use sdf_core::AnyField;
use sdf_core::nalgebra::UnitQuaternion;
use sdf_core::placed::Similarity;
use sdf_field::{BakeOptions, Field, GridSize, MeshView, Threads};
use sdf_procedural::{Mesh, random::Random};

use super::animation::Animation;
use super::budget::Budget;
use super::mesh_spec::{MeshSpec, open_edges, regular_file, weld};
use super::spec::{ClothSpec, ObstacleSpec, RigidSpec, SceneSpec, SoftSpec, Start};
use super::{SceneError, invalid};
use crate::surface::{Carrier, Surface};
use crate::world::World;
use crate::{Body, CagedBody, V3, cloth, soft};

/// A scene that is ready to run.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Everything that moves.
    pub world: World,
    /// Skins of what moves.
    pub surfaces: Vec<Surface>,
    /// Fields that nothing moves.
    pub obstacles: Vec<Field>,
    /// Closed forms that change with time.
    pub animations: Vec<Animation>,
    /// For each rigid body its field.
    pub fields: Vec<Field>,
    /// Soft bodies that others touch.
    pub cages: Vec<CagedBody>,
    /// Time since the start.
    pub time: f64,
    /// Reasons why figures of its runs may say little, a line each.
    pub warnings: Vec<String>,
}

/// The fields that nothing moves, without closed forms that change.
#[derive(Clone, Debug, Default)]
pub struct Obstacles {
    /// The fields, in the order of the scene.
    pub fields: Vec<Field>,
    /// Warnings of these, a line each, for the stage.
    pub warnings: Vec<String>,
}

impl Stage {
    /// Builds a scene; files are looked for in `folder`.
    pub fn build(spec: &SceneSpec, folder: &Path, threads: Threads) -> Result<Self, SceneError> {
        let obstacles = Self::obstacles(spec, folder, threads)?;
        Self::with_obstacles(spec, folder, threads, obstacles)
    }

    /// The fields that nothing moves: what takes longest, and variants of a scene share it.
    pub fn obstacles(spec: &SceneSpec, folder: &Path, threads: Threads) -> Result<Obstacles, SceneError> {
        let mut obstacles = Obstacles::default();
        for (number, obstacle) in (1..).zip(&spec.obstacle).filter(|(_, spec)| spec.becomes.is_none()) {
            let name = format!("obstacle {number}");
            let field = obstacle_field(&name, obstacle, folder, threads, &mut obstacles.warnings);
            obstacles.fields.push(field.map_err(|message| invalid_obstacle(spec, number, &message))?);
        }
        Ok(obstacles)
    }

    /// Builds a scene with obstacles that are there already.
    pub fn with_obstacles(
        spec: &SceneSpec,
        folder: &Path,
        threads: Threads,
        obstacles: Obstacles,
    ) -> Result<Self, SceneError> {
        let mut world = World::new(spec.gravity);
        world.drag = spec.drag;
        world.damping = spec.damping;
        world.loaded_rounds = spec.loaded_rounds;
        world.rolling_friction = spec.rolling_friction;
        world.recovery_speed = spec.recovery;
        let animation = |(number, obstacle): (usize, &ObstacleSpec)| {
            animation(obstacle).map_err(|message| invalid_obstacle(spec, number, &message)).transpose()
        };
        let animations = (1..).zip(&spec.obstacle).filter_map(animation).collect::<Result<_, _>>()?;
        let Obstacles { fields: obstacles, warnings } = obstacles;
        let mut stage =
            Self { world, surfaces: vec![], obstacles, animations, fields: vec![], cages: vec![], time: 0.0, warnings };
        stage.fill(spec, folder, threads).map_err(|message| invalid(&spec.name, message))?;
        if stage.surfaces.is_empty() {
            stage.warnings.push("nothing moves: give a [[cloth]], [[rigid]] or [[soft]]".to_owned());
        }
        Ok(stage)
    }

    fn fill(&mut self, spec: &SceneSpec, folder: &Path, threads: Threads) -> Result<(), String> {
        let (mut random, mut budget) = (Random::new(spec.seed), Budget::default());
        for (number, cloth) in (1..).zip(&spec.cloth) {
            let (name, first) = (format!("cloth {number}"), self.surfaces.len());
            let told = |message| format!("{name}: {message}");
            let mesh = cloth.mesh.mesh(folder).map_err(told)?;
            if mesh.points.is_empty() {
                return Err(told(
                    "it has no points: give its mesh cells or strands, and a net strands of a cell or more".to_owned(),
                ));
            }
            budget.add(&name, &mesh, 1)?;
            self.add_cloth(cloth, mesh, &mut random).map_err(told)?;
            self.check_from(first).map_err(told)?;
        }
        for (number, rigid) in (1..).zip(&spec.rigid) {
            let (name, first) = (format!("rigid {number}"), self.surfaces.len());
            let told = |message| format!("{name}: {message}");
            let mesh = rigid.mesh.mesh(folder).map_err(told)?;
            budget.add(&name, &mesh, rigid.count.iter().map(|count| *count as usize).product())?;
            check_closed(&mesh).map_err(told)?;
            self.add_rigid(&name, rigid, &mesh, threads, &mut random).map_err(told)?;
            self.check_from(first).map_err(told)?;
        }
        for (number, soft) in (1..).zip(&spec.soft) {
            let (name, first) = (format!("soft {number}"), self.surfaces.len());
            let told = |message| format!("{name}: {message}");
            let mesh = soft.mesh.mesh(folder).map_err(told)?;
            budget.add(&name, &mesh, 1)?;
            check_closed(&mesh).map_err(told)?;
            // A mesh without points has its message from the bake.
            if !mesh.points.is_empty() {
                budget.add_cubes(&name, soft::cube_count(&mesh.points, soft.cell, soft.padding))?;
            }
            self.add_soft(&name, soft, &mesh, threads, &mut random).map_err(told)?;
            self.check_from(first).map_err(told)?;
        }
        Ok(())
    }

    /// Refuses bodies from a surface on that begin where recordings cannot hold them.
    fn check_from(&self, first: usize) -> Result<(), String> {
        let beyond = self.surfaces[first..].iter().find_map(|surface| surface.beyond_f32(&self.world));
        beyond.map_or(Ok(()), |x| Err(too_far(x)))
    }

    fn add_cloth(&mut self, spec: &ClothSpec, mut mesh: Mesh, random: &mut Random) -> Result<(), String> {
        let pose = Pose::of(&spec.start, random);
        let fabric = cloth::Fabric { mass: spec.mass, stretch: spec.stretch, bend: spec.bend };
        let first = self.world.x.len();
        let faces = mesh.triangles.clone();
        // Sheets hold together at seams of their file; strings may begin at one place.
        let vertices = if faces.is_empty() { (0..mesh.points.len() as u32).collect() } else { weld(&mut mesh) };
        let points: Vec<_> = mesh.points.iter().map(|point| pose.apply(point)).collect();
        let surface = match faces.is_empty() {
            true => cloth::add_strings(&mut self.world, &points, &mesh.segments, &fabric),
            false => cloth::add(&mut self.world, &points, &mesh.triangles, &fabric),
        };
        self.world.v[first..].fill(V3::from(spec.start.velocity));
        for pin in &spec.pins {
            let vertex = vertices.get(*pin as usize);
            let vertex =
                vertex.ok_or_else(|| format!("it has no vertex {pin} to pin: it has {}, from 0 on", vertices.len()))?;
            self.world.inv_mass[first + *vertex as usize] = 0.0;
            self.world.v[first + *vertex as usize] = V3::zeros();
        }
        let is_welded = points.len() < vertices.len();
        self.surfaces.push(if is_welded { surface.recorded_as(vertices, faces) } else { surface });
        Ok(())
    }

    fn add_rigid(
        &mut self,
        name: &str,
        spec: &RigidSpec,
        mesh: &Mesh,
        threads: Threads,
        random: &mut Random,
    ) -> Result<(), String> {
        let (body, points) =
            Body::of_mesh(&mesh.points, &mesh.triangles, spec.mass).ok_or_else(|| why_no_body(spec, mesh))?;
        let field = match &spec.mesh {
            MeshSpec::Cuboid(cuboid) => {
                Field::new(sdf_core::shapes::Cuboid::new(cuboid.half).ok_or("a box without sides")?)
            }
            _ => {
                let mesh = Mesh { points: points.clone(), ..mesh.clone() };
                bake(name, &mesh, spec.cells, threads, &mut self.warnings)?
            }
        };
        let points: Arc<[_]> = points.into();
        let carrier = |id: u32| Carrier::Body { id, points: points.clone() };
        let surface = Surface::of_faces(mesh.triangles.clone(), points.len(), carrier(0));
        let [columns, rows, layers] = spec.count;
        for (layer, row, column) in (0..layers)
            .flat_map(|layer| (0..rows).flat_map(move |row| (0..columns).map(move |column| (layer, row, column))))
        {
            let pose = Pose::of(&spec.start, random);
            let steps = [column, row, layer].map(f64::from);
            let shift = V3::new(steps[0] * spec.apart[0], steps[1] * spec.apart[1], steps[2] * spec.apart[2]);
            let mut body = body.clone();
            body.position = V3::from(pose.apply(&body.position.into())) + shift;
            body.rotation = pose.rotation;
            body.velocity = V3::from(spec.start.velocity);
            body.set_angular_velocity(&V3::from(spec.start.spin));
            let id = self.world.add_body(body);
            let mut surface = surface.clone();
            surface.carrier = carrier(id);
            self.surfaces.push(surface);
            self.fields.push(field.clone());
        }
        Ok(())
    }

    fn add_soft(
        &mut self,
        name: &str,
        spec: &SoftSpec,
        mesh: &Mesh,
        threads: Threads,
        random: &mut Random,
    ) -> Result<(), String> {
        let field = bake(name, mesh, spec.cells, threads, &mut self.warnings)?;
        let volume = soft::volume(&mesh.points, &mesh.triangles);
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(why_no_volume(volume).to_owned());
        }
        let matter = soft::Matter { density: spec.density, young: spec.young, poisson: spec.poisson };
        // A cube whose center is farther than this has no point within the padding.
        let reach = if spec.padding > 0.0 { spec.padding + 0.5 * 3_f64.sqrt() * spec.cell } else { 0.0 };
        let is_wanted = |point: V3| field.sample(&[point.into()], Threads::ONE)[0].value < reach;
        let (first, first_tet) = (self.world.x.len(), self.world.tets.len());
        let (mut points, mut faces) = (mesh.points.clone(), mesh.triangles.clone());
        if !soft::split_edges(&mut points, &mut faces, spec.cell) {
            return Err(
                "its faces would be cut into over 4 million, each about a cell wide: give a larger cell".to_owned()
            );
        }
        let surface = soft::add(&mut self.world, &points, &faces, spec.cell, spec.padding, &matter, is_wanted);
        if let Some(map) = spec.touched {
            let cage = CagedBody::new(field, &self.world, first, first_tet, map.into());
            self.cages.push(if spec.padding > 0.0 { cage.with_reach(spec.padding) } else { cage.with_halo(spec.cell) });
        }
        let pose = Pose::of(&spec.start, random);
        for x in &mut self.world.x[first..] {
            *x = V3::from(pose.apply(&(*x).into()));
        }
        self.world.v[first..].fill(V3::from(spec.start.velocity));
        self.surfaces.push(surface);
        Ok(())
    }
}

/// A pose at the start.
struct Pose {
    rotation: UnitQuaternion<f64>,
    translation: V3,
}

impl Pose {
    fn of(start: &Start, random: &mut Random) -> Self {
        let about = |axis: V3, degrees: f64| UnitQuaternion::from_scaled_axis(axis * degrees.to_radians());
        let [x, y, z] = start.turn;
        let mut rotation = about(V3::z(), z) * about(V3::y(), y) * about(V3::x(), x);
        let mut translation = V3::from(start.translate);
        if let Some(half) = start.random {
            let axis = V3::from(random.point_in_cube(1.0));
            rotation = about(axis.normalize(), random.between(0.0, 360.0)) * rotation;
            translation += V3::from(random.point_in_cube(half));
        }
        Self { rotation, translation }
    }

    fn apply(&self, point: &[f64; 3]) -> [f64; 3] {
        (self.rotation * V3::from(*point) + self.translation).into()
    }
}

/// Refuses an open mesh for a body with a volume.
fn check_closed(mesh: &Mesh) -> Result<(), String> {
    match open_edges(mesh) {
        None => Ok(()),
        Some((count, [from, to])) => Err(format!(
            "its mesh is open at {count} edges, one from {from:?} to {to:?}, and its mass is that of a closed one: \
             close the mesh, or make it a cloth"
        )),
    }
}

/// Why is this volume of a mesh not that of a body?
fn why_no_volume(volume: f64) -> &'static str {
    match volume {
        0.0 => "its mesh encloses no volume: it is flat, or too small for f64: give a solid, or scale it",
        _ if volume.is_finite() => "its mesh encloses no volume: turn its faces outward",
        _ => "the volume of its mesh is beyond f64: scale it down",
    }
}

fn why_no_body(spec: &RigidSpec, mesh: &Mesh) -> String {
    if mesh.triangles.is_empty() {
        return "its mesh has no triangles, and so no mass: give a closed mesh, or make lines a cloth".to_owned();
    }
    let volume = soft::volume(&mesh.points, &mesh.triangles);
    match Body::of_mesh(&mesh.points, &mesh.triangles, 1.0) {
        Some(_) => format!("mass = {:e}: its moments of inertia are beyond f64: give a mass nearer to 1", spec.mass),
        None if volume > 0.0 && volume.is_finite() => {
            "the moments of inertia of its mesh are beyond f64: scale it nearer to 1".to_owned()
        }
        None => why_no_volume(volume).to_owned(),
    }
}

pub(super) fn too_far(x: f64) -> String {
    format!("a coordinate is {x:.3e}: give one within {:.1e}, as recordings hold f32", f32::MAX)
}

fn invalid_obstacle(spec: &SceneSpec, number: usize, message: &str) -> SceneError {
    invalid(&spec.name, format!("obstacle {number}: {message}"))
}

/// Bakes the mesh of what is called `name`, and warns of a solid that no node of its grid is inside of.
fn bake(name: &str, mesh: &Mesh, cells: u32, threads: Threads, warnings: &mut Vec<String>) -> Result<Field, String> {
    let options = BakeOptions { size: GridSize::Cells(cells), threads, ..BakeOptions::default() };
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let baked = Field::bake(view, &options).map_err(|error| error.to_string())?;
    warnings.extend(baked.thin_voxel().map(|voxel| {
        format!(
            "{name}: no node is inside the solid: it is thinner than a voxel of {voxel:.2e}: others pass \
             through it: give more cells"
        )
    }));
    Ok(baked.field)
}

/// The closed form of an obstacle that changes; `None` of one that does not.
fn animation(spec: &ObstacleSpec) -> Result<Option<Animation>, String> {
    let (Some(from), Some(to)) = (&spec.shape, &spec.becomes) else { return Ok(None) };
    let placed = |text: &String| Ok::<_, String>(translated(closed_form(text)?, spec)?.into_any());
    let animation = Animation::new(placed(from)?, placed(to)?, spec.period.unwrap_or(1.0));
    let why = "becomes: give the same shape as shape has (sphere, torus, cylinder, capsule, box or rounded_box), with other \
               parameters and the same pose";
    animation.map(Some).ok_or_else(|| why.to_owned())
}

fn closed_form(text: &str) -> Result<Field, String> {
    let shape = sdf_formats::field_file::read_text(text, "the obstacle's shape");
    Ok(Field::new(shape.map_err(|error| error.to_string())?))
}

fn obstacle_field(
    name: &str,
    spec: &ObstacleSpec,
    folder: &Path,
    threads: Threads,
    warnings: &mut Vec<String>,
) -> Result<Field, String> {
    let field = match (&spec.mesh, &spec.shape, &spec.file) {
        (Some(mesh), _, _) => {
            let [x, y, z] = spec.translate;
            let mesh = mesh.mesh(folder)?.transformed(|point| [point[0] + x, point[1] + y, point[2] + z]);
            warnings.extend(open_edges(&mesh).map(|(count, [from, to])| {
                format!(
                    "{name}: its mesh is open at {count} edges, one from {from:?} to {to:?}: others pass through it \
                     where it has no inside: close the mesh"
                )
            }));
            return bake(name, &mesh, spec.grid_cells(), threads, warnings);
        }
        (_, Some(text), _) => closed_form(text)?,
        (_, _, Some(file)) => {
            let field = Field::open(regular_file(folder, file)?).map_err(|error| error.to_string())?;
            if has_thin_grid(field.as_any()) {
                warnings.push(format!(
                    "{name}: no node of its grid is inside the solid: it is thinner than a voxel, or its mesh is open: \
                     others pass through it: bake a closed mesh with more cells"
                ));
            }
            field
        }
        _ => return Err("an obstacle is one of mesh, shape and file: give one of them".to_owned()),
    };
    translated(field, spec)
}

/// Is there a grid that no node is inside of? Offsets and shells make another solid of a grid, and are not looked into.
fn has_thin_grid(field: &AnyField) -> bool {
    match field {
        AnyField::Grid(grid) => !Field::new(AnyField::Grid(grid.clone())).has_inside(),
        AnyField::Placed(placed) => has_thin_grid(&placed.field),
        AnyField::Stretched(placed) => has_thin_grid(&placed.field),
        AnyField::Union(union) => union.parts().iter().any(has_thin_grid),
        _ => false,
    }
}

fn translated(field: Field, spec: &ObstacleSpec) -> Result<Field, String> {
    if spec.translate == [0.0; 3] {
        return Ok(field);
    }
    let moved = Similarity::new(spec.translate, [0.0, 0.0, 0.0, 1.0], 1.0).ok_or("translate: give finite numbers")?;
    Ok(Field::new(AnyField::placed(field.into_any(), moved)))
}
