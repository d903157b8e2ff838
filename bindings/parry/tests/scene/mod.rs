//! A bumpy ground, baked to a grid, and four bodies on it: a box, a ball, a capsule and a mesh of a thousand faces. Shared by the test
//! and the example.

use parry3d::bounding_volume::Aabb as ParryAabb;
use parry3d::math::{Pose, Vector};
use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher};
use parry3d::shape::{Ball, SharedShape, TriMesh};
use rapier3d::prelude::{
    CCDSolver, ColliderBuilder, ColliderSet, DefaultBroadPhase, ImpulseJointSet, IntegrationParameters, IslandManager,
    MultibodyJointSet, NarrowPhase, PhysicsPipeline, RigidBody, RigidBodyBuilder, RigidBodyHandle, RigidBodySet,
    SoftBodySet,
};
use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::AnyField;
use sdf_parry::{SdfDispatcher, SdfShape, Search};

/// Points and faces.
pub type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Steps of a second.
pub const STEPS: u32 = 60;

/// A slab of 6 × 6, half a unit thick, whose upper side has bumps of about a tenth of a unit.
pub fn bumpy_slab() -> Mesh {
    const SQUARES: u32 = 60;
    let row = SQUARES + 1;
    let coordinate = |index: u32| 6.0 * f64::from(index) / f64::from(SQUARES) - 3.0;
    let side = |bottom: bool| {
        (0..row * row).map(move |index| {
            let (x, y) = (coordinate(index % row), coordinate(index / row));
            let height = 0.06 * ((4.0 * x).sin() + (3.1 * y + 0.5).cos()) + 0.03 * (x * x + y * y).sqrt();
            [x, y, if bottom { -0.5 } else { height }]
        })
    };
    let points = side(false).chain(side(true)).collect();
    let mut faces = vec![];
    for (i, j) in (0..SQUARES).flat_map(|j| (0..SQUARES).map(move |i| (i, j))) {
        let corner = i + j * row;
        let [a, b, c, d] = [corner, corner + 1, corner + row + 1, corner + row];
        let under = row * row;
        faces.extend([[a, b, c], [a, c, d], [a + under, c + under, b + under], [a + under, d + under, c + under]]);
    }
    for i in 0..SQUARES {
        let rims = [
            (i + 1, i),
            (i + SQUARES * row, i + 1 + SQUARES * row),
            (i * row, (i + 1) * row),
            ((i + 1) * row + SQUARES, i * row + SQUARES),
        ];
        for (a, b) in rims {
            let (c, d) = (b + row * row, a + row * row);
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, faces)
}

/// The mesh baked to a dense grid of this spacing.
pub fn bake((points, faces): &Mesh, spacing: f64) -> AnyField {
    let mesh = TriangleMesh::new(points, faces).expect("a mesh by formula");
    let lattice = lattice_around(&mesh.bounds(), spacing, 3).expect("a small grid");
    dense::bake(&MeshDistance::new(&mesh, None), &lattice, &|_| ()).into_grid(&lattice).grid.into()
}

/// A ball with lumps, of about a thousand faces.
pub fn lumpy_ball() -> TriMesh {
    let (points, faces) = Ball::new(0.5).to_trimesh(32, 16);
    let lumpy =
        points.into_iter().map(|p| p * (1.0 + 0.15 * (9.0 * p.x).sin() * (8.0 * p.y).cos() + 0.1 * (7.0 * p.z).sin()));
    TriMesh::new(lumpy.collect(), faces).expect("a mesh by formula")
}

/// The four bodies: name, size and shape.
pub fn bodies() -> [(&'static str, f32, SharedShape); 4] {
    [
        ("box", 1.0, SharedShape::cuboid(0.5, 0.5, 0.5)),
        ("ball", 1.0, SharedShape::ball(0.5)),
        ("capsule", 1.4, SharedShape::capsule(Vector::new(-0.4, 0.0, 0.0), Vector::new(0.4, 0.0, 0.0), 0.3)),
        ("mesh", 1.0, SharedShape::new(lumpy_ball())),
    ]
}

/// All that rapier needs for a step.
pub struct World {
    pub bodies: RigidBodySet,
    pub colliders: ColliderSet,
    pub narrow: NarrowPhase,
    pub parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    islands: IslandManager,
    broad: DefaultBroadPhase,
    joints: ImpulseJointSet,
    multibodies: MultibodyJointSet,
    soft: SoftBodySet,
    ccd: CCDSolver,
}

impl World {
    pub fn new(narrow: NarrowPhase) -> Self {
        Self {
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            narrow,
            parameters: IntegrationParameters::default(),
            pipeline: PhysicsPipeline::new(),
            islands: IslandManager::new(),
            broad: DefaultBroadPhase::new(),
            joints: ImpulseJointSet::new(),
            multibodies: MultibodyJointSet::new(),
            soft: SoftBodySet::new(),
            ccd: CCDSolver::new(),
        }
    }

    /// A world whose colliders may be fields. Contacts are searched in every step: rapier would keep normals while a body moves by up
    /// to 5 cm, and a ball that rolls in a hollow gains as much by that as damping takes.
    pub fn with_fields(search: Search) -> Self {
        let mut world =
            Self::new(NarrowPhase::with_query_dispatcher(SdfDispatcher { search }.chain(DefaultQueryDispatcher)));
        world.parameters.contact_recycling = false;
        world
    }

    pub fn add_ground(&mut self, field: AnyField) {
        let shape = SdfShape::new(field).expect("a grid is bounded");
        self.colliders.insert(ColliderBuilder::new(SharedShape::new(shape)).friction(0.8));
    }

    /// A body that never sleeps. Round ones would roll to and fro for minutes: nothing in rapier slows them but damping.
    pub fn add(&mut self, shape: SharedShape, at: Vector, turned: Vector) -> RigidBodyHandle {
        let body = RigidBodyBuilder::dynamic().pose(Pose::new(at, turned)).angular_damping(8.0).can_sleep(false);
        let body = self.bodies.insert(body);
        self.colliders.insert_with_parent(ColliderBuilder::new(shape).friction(0.8), body, &mut self.bodies);
        body
    }

    pub fn step(&mut self) {
        self.pipeline.step(
            Vector::new(0.0, 0.0, -9.81),
            &self.parameters,
            &mut self.islands,
            &mut self.broad,
            &mut self.narrow,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.joints,
            &mut self.multibodies,
            &mut self.soft,
            &mut self.ccd,
            &(),
            &(),
        );
    }

    pub fn body(&self, handle: RigidBodyHandle) -> &RigidBody {
        &self.bodies[handle]
    }
}

/// The four bodies above a ground, each in its quarter, a little turned.
pub fn four_bodies_on(
    ground: AnyField,
    search: Search,
) -> (World, Vec<(&'static str, f32, SharedShape, RigidBodyHandle)>) {
    let mut world = World::with_fields(search);
    world.add_ground(ground);
    let corners = [(-1.4, -1.4), (1.4, -1.4), (1.4, 1.4), (-1.4, 1.4)];
    let placed = bodies().into_iter().zip(corners).map(|((name, size, shape), (x, y))| {
        let handle = world.add(shape.clone(), Vector::new(x, y, 1.2), Vector::new(0.2, 0.1, 0.3));
        (name, size, shape, handle)
    });
    let placed = placed.collect();
    (world, placed)
}

/// Points all over the true surface of a body, in its frame.
pub fn surface_points(shape: &SharedShape) -> Vec<Vector> {
    let bounds: ParryAabb = shape.compute_local_aabb();
    let (middle, reach) = (bounds.center(), bounds.half_extents().length());
    let (points, faces) = match shape.as_trimesh() {
        Some(mesh) => (mesh.vertices().to_vec(), mesh.indices().to_vec()),
        None => Ball::new(reach).to_trimesh(128, 64),
    };
    let inner = faces.iter().flat_map(|face| {
        let [a, b, c] = face.map(|vertex| points[vertex as usize]);
        [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
    });
    let all: Vec<Vector> = points.iter().copied().chain(inner).collect();
    if shape.as_trimesh().is_some() {
        return all;
    }
    // From outside onto the surface: the nearest points of a convex body are everywhere on it.
    let corners = shape.as_cuboid().map_or(vec![], |cuboid| {
        let h = cuboid.half_extents;
        (0..8).map(|k| Vector::new(sign(k & 1) * h.x, sign(k & 2) * h.y, sign(k & 4) * h.z)).collect()
    });
    let projected = all.iter().map(|p| shape.project_local_point(middle + *p, false).point);
    // The rays through a cuboid's sides, too: nearest points alone crowd at its corners.
    let rays = all.iter().map(|p| {
        let direction = -p.normalize();
        let ray = parry3d::query::Ray::new(middle + *p * 2.0, direction);
        shape.cast_local_ray(&ray, f32::MAX, true).map_or(middle, |time| ray.point_at(time))
    });
    projected.chain(rays).chain(corners).collect()
}

fn sign(bit: u32) -> f32 {
    if bit == 0 { -1.0 } else { 1.0 }
}
