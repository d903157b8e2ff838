//! Every field: one table of named fields, so that a law is written once and asked of all of them.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector2, Vector3};
use sdf_bake::SparseGrid;
use sdf_bake::sparse::Quantize;
use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion, Union};
use sdf_core::grid::sparse::{BRICK, NO_BRICK, Sparse, brick_counts};
use sdf_core::grid::{BlockBounds, Dense, Grid, Lattice, Storage, WithBlockBounds, cell_slope, measure_slope_bound};
use sdf_core::placed::{Placed, Rigid, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};
use sdf_core::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Float, Goal, Interval, Real, Sample, Sdf};

use crate::any_field::AnyField;
use crate::random::Random;

type Point = Vector3<f64>;

/// How φ relates to the true distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// It is the distance, everywhere.
    Exact,
    /// It has the distance's sign and at most its magnitude.
    Bound,
    /// An interpolant of samples: neither.
    Samples,
}

/// A field, and what is known of it from elsewhere.
pub struct Scene {
    pub name: &'static str,
    field: AnyField,
    pub meaning: Meaning,
    /// φ is a convex function.
    pub convex: bool,
    /// Membership of the solid, written down without φ: the oracle of sign and magnitude. None for samples.
    inside: Option<Box<dyn Fn(Point) -> bool>>,
    /// The surface, where bounded, lies in the cube around the origin that reaches this far.
    pub size: f64,
    /// Coordinates where the shape has centres, axes, faces and corners, as far as they are exact in floating point.
    pub creases: Vec<f64>,
}

impl Sdf for Scene {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.field.evaluate(point)
    }
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.field.value(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }
}

impl EnclosedSdf for Scene {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.field.enclose_box(region)
    }
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.field.enclosure(about, corners)
    }
    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.field.is_convex_on(corners)
    }
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.field.max_rise_to_corners(corners)
    }
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        self.field.exact_minimum(corners, goal)
    }
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(region)
    }
}

impl Scene {
    fn new(name: &'static str, size: f64, meaning: Meaning, field: Option<impl EnclosedSdf + 'static>) -> Self {
        let field = AnyField::new(field.unwrap_or_else(|| panic!("the parameters of {name} make no field")));
        Self { name, field, meaning, convex: false, inside: None, size, creases: vec![] }
    }

    fn convex(self) -> Self {
        Self { convex: true, ..self }
    }

    fn inside(self, inside: impl Fn(Point) -> bool + 'static) -> Self {
        Self { inside: Some(Box::new(inside)), ..self }
    }

    /// `magnitudes` are mirrored, and zero belongs to them.
    fn creases(self, magnitudes: &[f64]) -> Self {
        let creases = magnitudes.iter().flat_map(|x| [-x, *x]).chain([0.0]).collect();
        Self { creases, ..self }
    }

    /// Whether the solid holds the point; `None` where there is no oracle.
    pub fn holds(&self, point: Point) -> Option<bool> {
        self.inside.as_ref().map(|inside| inside(point))
    }

    /// Points all around, most near the shape, a few far away.
    pub fn random_points(&self, random: &mut Random, count: usize) -> Vec<Point> {
        (0..count).map(|i| random.in_cube(self.size * if i % 8 == 0 { 20.0 } else { 1.5 })).collect()
    }

    /// Every point whose coordinates are creases.
    pub fn crease_points(&self) -> Vec<Point> {
        let at = &self.creases;
        at.iter().flat_map(|x| at.iter().flat_map(|y| at.iter().map(|z| Vector3::new(*x, *y, *z)))).collect()
    }
}

/// A field whose value is `steepness` times another's: a slope above one that no cull may ignore.
#[derive(Clone, Copy)]
pub struct Steep<F> {
    pub field: F,
    pub steepness: f64,
}

impl<F: Sdf> Sdf for Steep<F> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate(point);
        let steepness = R::from_f64(self.steepness);
        Sample { value: sample.value * steepness, gradient: sample.gradient * steepness, ..sample }
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level / self.steepness)
    }
    fn slope_bound(&self) -> f64 {
        self.field.slope_bound() * self.steepness
    }
}

impl<F: EnclosedSdf> EnclosedSdf for Steep<F> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let BoxEnclosure { range, slope_bound } = self.field.enclose_box(region);
        BoxEnclosure { range: range.scale(self.steepness), slope_bound: slope_bound * self.steepness }
    }
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.field.enclosure(about, corners).pull_back(&Matrix3::identity(), R::from_f64(self.steepness))
    }
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(region) * self.steepness
    }
}

/// The samples of a field on a lattice, `steepness` times as large.
pub fn sampled(field: &impl Sdf, lattice: Lattice, steepness: f64) -> Grid<Dense<Vec<f32>>> {
    let mut samples = vec![0.0; lattice.node_count()];
    let [x, y, z] = lattice.nodes();
    for (i, j, k) in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (i, j, k)))) {
        let node = Vector3::from(lattice.node([i, j, k]));
        samples[lattice.index([i, j, k])] = (field.value(node) * steepness) as f32;
    }
    let storage = Dense::new(&lattice, samples).unwrap();
    let steepest = measure_slope_bound(&lattice, &storage);
    Grid::new(lattice, storage, steepest).unwrap()
}

/// With what is certain of each place of 8 × 8 × 8 nodes beside it.
pub fn bounded(grid: Grid<Dense<Vec<f32>>>) -> Grid<WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>> {
    let lattice = *grid.lattice();
    let cells = lattice.cells();
    let [along_x, along_y, along_z] = brick_counts(&lattice);
    let mut bounds = vec![];
    for index in 0..along_x * along_y * along_z {
        let place = [index % along_x, index / along_x % along_y, index / along_x / along_y];
        // Of all cells with a corner in the place; those have a few nodes more.
        let first = place.map(|n| (n * BRICK).saturating_sub(1));
        let last: [u32; 3] = std::array::from_fn(|axis| ((place[axis] + 1) * BRICK).min(cells[axis]));
        let mut of_place = BlockBounds::EMPTY;
        for z in first[2]..last[2] {
            for y in first[1]..last[1] {
                for x in first[0]..last[0] {
                    let corners = grid.storage().corners([x, y, z]);
                    let slope = cell_slope(corners, lattice.spacing()) as f32 * (1.0 + f32::EPSILON);
                    let of_corner = |sample: f32| BlockBounds {
                        range: Interval { lower: sample, upper: sample },
                        slope_bound: slope,
                    };
                    of_place = corners.into_iter().map(of_corner).fold(of_place, BlockBounds::union);
                }
            }
        }
        bounds.push(of_place);
    }
    let storage = WithBlockBounds::new(&lattice, grid.storage().clone(), bounds).unwrap();
    Grid::new(lattice, storage, grid.slope_bound()).unwrap()
}

/// The same in bricks: those whose nodes come `within` of the surface, and every eighth node for the rest.
pub fn sampled_in_bricks<C: Quantize>(field: &impl Sdf, lattice: Lattice, within: f64) -> Grid<Sparse<SparseGrid<C>>> {
    let places = brick_counts(&lattice);
    let mut grid = SparseGrid::<C> {
        table: vec![],
        slots: vec![],
        scales: vec![],
        samples: vec![],
        coarse: vec![],
        bounds: vec![],
        errors: vec![],
        slope_bound: 0.0,
        error_bound: 0.0,
    };
    let all = |counts: [u32; 3]| {
        let [x, y, z] = counts;
        (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
    };
    let value = |node: [u32; 3]| field.value(Vector3::from(lattice.node(node))) as f32;
    for place in all(places) {
        let node = |step: [u32; 3]| std::array::from_fn(|axis| place[axis] * BRICK + step[axis]);
        let values: Vec<f32> = all([BRICK; 3]).map(|step| value(node(step))).collect();
        let is_near = values.iter().any(|value| f64::from(value.abs()) < within);
        grid.table.push(if is_near { grid.slots.len() as u32 } else { NO_BRICK });
        if is_near {
            let least = values.iter().copied().fold(f32::INFINITY, f32::min);
            let greatest = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let scale = C::scale(least, greatest);
            grid.slots.push(place);
            grid.scales.push(scale);
            grid.samples.extend(values.iter().map(|value| C::encode(*value, scale)));
        }
    }
    grid.coarse = all(places.map(|count| count + 1)).map(|node| value(node.map(|n| n * BRICK))).collect();
    assert!(grid.table.contains(&NO_BRICK) && !grid.slots.is_empty(), "the scene has places of both kinds");
    grid.bounds = vec![BlockBounds { range: Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 }; grid.slots.len()];
    let bounds = grid.slots.iter().map(|place| bounds_of_brick(&lattice, &grid, *place)).collect();
    grid.bounds = bounds;
    let storage = Sparse::new(&lattice, grid).unwrap();
    let steepest = measure_slope_bound(&lattice, &storage);
    Grid::new(lattice, storage, steepest).unwrap()
}

/// Asks every node of a brick, and every cell with a corner among them.
fn bounds_of_brick<C: Quantize>(lattice: &Lattice, grid: &SparseGrid<C>, place: [u32; 3]) -> BlockBounds {
    let storage = Sparse::new(lattice, grid).unwrap();
    let mut bounds = BlockBounds::EMPTY;
    for index in 0..9_u32.pow(3) {
        let past: [u32; 3] =
            std::array::from_fn(|axis| place[axis] * BRICK + [index % 9, index / 9 % 9, index / 81][axis]);
        let is_own = (0..3).all(|axis| past[axis] / BRICK == place[axis] && past[axis] < lattice.nodes()[axis]);
        if is_own {
            let value = storage.node(past);
            bounds = BlockBounds { range: bounds.range.hull(Interval { lower: value, upper: value }), ..bounds };
        }
        let cell = past.map(|node| node.wrapping_sub(1));
        if (0..3).all(|axis| cell[axis] < lattice.cells()[axis]) {
            let slope = cell_slope(storage.corners(cell), lattice.spacing()) as f32;
            bounds.slope_bound = bounds.slope_bound.max(slope.next_up());
        }
    }
    bounds
}

/// A lattice that spans the cube around the origin that reaches `half` to either side.
pub fn cube_lattice(half: f64, cells: u32) -> Lattice {
    Lattice::new([-half; 3], 2.0 * half / f64::from(cells), [cells + 1; 3]).unwrap()
}

/// Every field, with all its lengths multiplied by `scale`.
pub fn scenes(scale: f64) -> Vec<Scene> {
    [shapes(scale), bent_shapes(scale), combinations(scale), placements(scale), grids(scale)]
        .into_iter()
        .flatten()
        .collect()
}

fn shapes(s: f64) -> Vec<Scene> {
    use Meaning::{Bound, Exact};
    let half_extents = [0.5 * s, 0.75 * s, 0.875 * s];
    let rounded = [0.375 * s, 0.5 * s, 0.25 * s];
    let (a, b) = (Vector3::new(-0.5, 0.125, 0.25) * s, Vector3::new(0.5, -0.25, 0.625) * s);
    let upright = Vector3::new(0.0, 0.0, 0.5) * s;
    let normal = Vector3::new(1.0, -2.0, 2.0) / 3.0;
    let radii = [0.25 * s, 0.5 * s, 1.0 * s];

    let mut scenes = vec![
        Scene::new("sphere", s, Exact, Sphere::new(0.75 * s))
            .convex()
            .inside(move |p| p.norm() <= 0.75 * s)
            .creases(&[0.75 * s]),
        Scene::new("half-space", s, Exact, HalfSpace::new([2.0, -4.0, 4.0], 0.25 * s))
            .convex()
            .inside(move |p| normal.dot(&p) <= 0.25 * s)
            .creases(&[0.25 * s]),
        Scene::new("cuboid", s, Exact, Cuboid::new(half_extents))
            .convex()
            .inside(move |p| (0..3).all(|k| p[k].abs() <= half_extents[k]))
            .creases(&half_extents),
        Scene::new("rounded box", s, Exact, RoundedBox::new(rounded, 0.25 * s))
            .convex()
            .inside(move |p| distance_to_box(p, rounded) <= 0.25 * s)
            .creases(&[0.375 * s, 0.5 * s, 0.25 * s, 0.625 * s]),
        Scene::new("capsule", s, Exact, Capsule::new(a.into(), b.into(), 0.25 * s))
            .convex()
            .inside(move |p| distance_to_segment(p, a, b) <= 0.25 * s)
            .creases(&[0.5 * s, 0.125 * s, 0.25 * s, 0.625 * s]),
        Scene::new("upright capsule", s, Exact, Capsule::new((-upright).into(), upright.into(), 0.375 * s))
            .convex()
            .inside(move |p| distance_to_segment(p, -upright, upright) <= 0.375 * s)
            .creases(&[0.5 * s, 0.375 * s]),
        Scene::new("capsule with coinciding ends", s, Exact, Capsule::new(a.into(), a.into(), 0.375 * s))
            .convex()
            .inside(move |p| (p - a).norm() <= 0.375 * s)
            .creases(&[0.5 * s, 0.125 * s, 0.25 * s]),
        Scene::new("cylinder", s, Exact, Cylinder::new(0.5 * s, 0.75 * s))
            .convex()
            .inside(move |p| p.xy().norm() <= 0.5 * s && p.z.abs() <= 0.75 * s)
            .creases(&[0.5 * s, 0.75 * s, 0.25 * s]),
        Scene::new("octahedron", s, Exact, Octahedron::new(0.875 * s))
            .convex()
            .inside(move |p| p.abs().sum() <= 0.875 * s)
            .creases(&[0.875 * s, 0.4375 * s, 0.25 * s]),
        Scene::new("ellipsoid", s, Bound, Ellipsoid::new(radii))
            .convex()
            .inside(move |p| (0..3).map(|k| (p[k] / radii[k]).powi(2)).sum::<f64>() <= 1.0)
            .creases(&radii),
        Scene::new("torus", s, Exact, Torus::new(0.625 * s, 0.25 * s))
            .inside(move |p| distance_to_ring(p, 0.625 * s) <= 0.25 * s)
            .creases(&[0.625 * s, 0.25 * s, 0.375 * s, 0.875 * s]),
        Scene::new("torus without a hole", s, Exact, Torus::new(0.5 * s, 0.5 * s))
            .inside(move |p| distance_to_ring(p, 0.5 * s) <= 0.5 * s)
            .creases(&[0.5 * s]),
    ];
    for (name, degrees) in [("cone of 1°", 1.0_f64), ("cone of 10°", 10.0), ("cone of 60°", 60.0)] {
        let (angle, height) = (degrees.to_radians(), if degrees > 45.0 { 0.5 * s } else { s });
        scenes.push(
            Scene::new(name, s, Exact, Cone::new(angle, height))
                .convex()
                .inside(move |p| p.z >= -height && p.xy().norm() <= -p.z * angle.tan())
                .creases(&[height, 0.5 * height]),
        );
    }
    scenes
}

fn bent_shapes(s: f64) -> Vec<Scene> {
    let mut scenes = vec![];
    for (name, cut) in [("bowl cut above its centre", 0.25), ("bowl cut below its centre", -0.25), ("half bowl", 0.0)] {
        let (radius, cut, thickness) = (0.75 * s, cut * s, 0.1875 * s);
        scenes.push(
            Scene::new(name, s, Meaning::Exact, Bowl::new(radius, cut, thickness))
                .inside(move |p| distance_to_bowl(p, radius, (cut / radius).acos()) <= 0.5 * thickness)
                .creases(&[radius, 0.25 * s]),
        );
    }
    for (name, degrees, leg) in [
        ("horseshoe bent by 60° with legs", 60.0_f64, 0.25),
        ("horseshoe bent by 60° without legs", 60.0, 0.0),
        ("horseshoe bent by 90° with legs", 90.0, 0.25),
        ("horseshoe bent by 90° without legs", 90.0, 0.0),
        ("horseshoe bent by 150° with legs", 150.0, 0.125),
        ("horseshoe bent by 150° without legs", 150.0, 0.0),
        // From the far side of the arc the plane of its own end is nearer than the wall, and must not be seen.
        ("nearly closed horseshoe", 170.0, 0.0),
    ] {
        let (radius, thickness, leg, half_depth) = (0.5 * s, 0.25 * s, leg * s, 0.3125 * s);
        let bend = degrees.to_radians();
        // Only a right angle has walls at exact coordinates, and cos(π/2) is not quite zero where the legs end.
        let creases = match degrees == 90.0 {
            true if leg > 0.0 => vec![half_depth, 0.625 * s, radius],
            true => vec![half_depth],
            false if degrees > 90.0 => vec![half_depth, 0.25 * s, radius],
            false => vec![half_depth, 0.25 * s, 0.125 * s],
        };
        scenes.push(
            Scene::new(name, s, Meaning::Exact, Horseshoe::new(radius, thickness, bend, leg, half_depth))
                .inside(move |p| p.z.abs() <= half_depth && in_horseshoe(p.xy(), radius, thickness, bend, leg))
                .creases(&creases),
        );
    }
    scenes
}

fn combinations(s: f64) -> Vec<Scene> {
    use Meaning::Bound;
    let (ball, block) = (Sphere::new(0.625 * s).unwrap(), Cuboid::new([0.375 * s, 0.75 * s, 0.5 * s]).unwrap());
    let in_ball = move |p: Point| p.norm() <= 0.625 * s;
    let in_block = move |p: Point| p.x.abs() <= 0.375 * s && p.y.abs() <= 0.75 * s && p.z.abs() <= 0.5 * s;
    let lifted = Placed { field: ball, placement: Rigid::new([0.0, 0.0, 0.5 * s], [0.0, 0.0, 0.0, 1.0]).unwrap() };
    let up = Vector3::new(0.0, 0.0, 0.5) * s;
    let creases = [0.375 * s, 0.75 * s, 0.5 * s, 0.625 * s];
    vec![
        Scene::new("union", s, Bound, Some(Union(ball, block)))
            .inside(move |p| in_ball(p) || in_block(p))
            .creases(&creases),
        Scene::new("intersection", s, Bound, Some(Intersection(ball, block)))
            .convex()
            .inside(move |p| in_ball(p) && in_block(p))
            .creases(&creases),
        Scene::new("difference", s, Bound, Some(Difference(block, ball)))
            .inside(move |p| in_block(p) && !in_ball(p))
            .creases(&creases),
        Scene::new("smooth union", 1.25 * s, Bound, SmoothUnion::new(ball, lifted, 0.25 * s))
            .inside(move |p| {
                let (a, b) = (p.norm() - 0.625 * s, (p - up).norm() - 0.625 * s);
                let nearness = (1.0 - (a - b).abs() / (0.25 * s)).max(0.0);
                a.min(b) <= nearness * nearness * 0.0625 * s
            })
            .creases(&[0.5 * s, 0.25 * s, 0.625 * s]),
        Scene::new("grown cuboid", 1.25 * s, Bound, Offset::new(block, 0.25 * s))
            .convex()
            .inside(move |p| distance_to_box(p, [0.375 * s, 0.75 * s, 0.5 * s]) <= 0.25 * s)
            .creases(&creases),
        Scene::new("shrunk cuboid", s, Bound, Offset::new(block, -0.125 * s))
            .convex()
            .inside(move |p| p.x.abs() <= 0.25 * s && p.y.abs() <= 0.625 * s && p.z.abs() <= 0.375 * s)
            .creases(&[0.25 * s, 0.625 * s, 0.375 * s]),
        Scene::new("shell of a cuboid", s, Bound, Shell::new(block, 0.25 * s))
            .inside(move |p| {
                let within = p.x.abs() < 0.25 * s && p.y.abs() < 0.625 * s && p.z.abs() < 0.375 * s;
                !within && distance_to_box(p, [0.375 * s, 0.75 * s, 0.5 * s]) <= 0.125 * s
            })
            .creases(&creases),
        Scene::new(
            "shell of an ellipsoid",
            s,
            Bound,
            Shell::new(Ellipsoid::new([0.5 * s, 0.5 * s, s]).unwrap(), 0.25 * s),
        )
        .inside(move |p| {
            let relative = Vector3::new(2.0 * p.x, 2.0 * p.y, p.z).norm() / s;
            (0.75..=1.25).contains(&relative)
        })
        .creases(&[0.5 * s, s]),
    ]
}

fn placements(s: f64) -> Vec<Scene> {
    use Meaning::Exact;
    let shift = Vector3::new(0.25, -0.125, 0.0625) * s;
    let turn = [0.1, -0.5, 0.3, 0.8];
    let quarter = [0.0, 0.0, 1.0, 1.0];
    let half_extents = [0.25 * s, 0.5 * s, 0.375 * s];
    let cuboid = Cuboid::new(half_extents).unwrap();
    let cone = Cone::new(PI / 6.0, 2.0 * s).unwrap();
    let in_cone = move |p: Point| p.z >= -2.0 * s && p.xy().norm() <= -p.z * (PI / 6.0).tan();
    let bar = Horseshoe::new(s, 0.5 * s, FRAC_PI_2, 0.5 * s, 0.5 * s).unwrap();
    let in_bar = move |p: Point| p.z.abs() <= 0.5 * s && in_horseshoe(p.xy(), s, 0.5 * s, FRAC_PI_2, 0.5 * s);
    let in_cuboid = move |p: Point| (0..3).all(|k| p[k].abs() <= half_extents[k]);
    let rigid = Rigid::new(shift.into(), turn);
    let half = Similarity::new(shift.into(), turn, 0.5).unwrap();
    let big = Similarity::new([0.0; 3], [0.3, 0.1, 0.0, -0.9], 3.0).unwrap();
    vec![
        Scene::new("turned cuboid", s, Exact, rigid.map(|placement| Placed { field: cuboid, placement }))
            .convex()
            .inside(move |p| in_cuboid(turn_back(p - shift, turn)))
            .creases(&[0.25 * s, 0.0625 * s]),
        Scene::new("small turned cone", 1.5 * s, Exact, Some(Placed { field: cone, placement: half }))
            .convex()
            .inside(move |p| in_cone(turn_back(p - shift, turn) / 0.5))
            .creases(&[0.25 * s, 0.0625 * s]),
        Scene::new("large cuboid", 3.0 * s, Exact, Some(Placed { field: cuboid, placement: big }))
            .convex()
            .inside(move |p| in_cuboid(turn_back(p, [0.3, 0.1, 0.0, -0.9]) / 3.0))
            .creases(&[0.75 * s]),
        Scene::new(
            "horseshoe placed twice",
            1.5 * s,
            Exact,
            Rigid::new([0.0, 0.25 * s, 0.0], quarter)
                .map(|placement| Placed { field: Placed { field: bar, placement: half }, placement }),
        )
        .inside(move |p| {
            let outer = turn_back(p - Vector3::new(0.0, 0.25, 0.0) * s, quarter);
            in_bar(turn_back(outer - shift, turn) / 0.5)
        })
        .creases(&[0.25 * s, 0.5 * s]),
        Scene::new(
            "stretched and mirrored cone",
            2.5 * s,
            Meaning::Bound,
            Stretch::new([0.5, -2.0, -1.0]).map(|placement| Placed { field: cone, placement }),
        )
        .convex()
        .inside(move |p| in_cone(p.component_div(&Vector3::new(0.5, -2.0, -1.0))))
        .creases(&[2.0 * s]),
    ]
}

fn grids(s: f64) -> Vec<Scene> {
    use Meaning::Samples;
    let ball = Sphere::new(0.5 * s).unwrap();
    let block = Cuboid::new([0.25 * s, 0.5 * s, 0.375 * s]).unwrap();
    let turned = Placed {
        field: sampled(&block, cube_lattice(0.75 * s, 12), 1.0),
        placement: Similarity::new([0.125 * s, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap(),
    };
    let creases = [0.75 * s, 0.5 * s, 0.625 * s, s];
    let fine = cube_lattice(0.75 * s, 48);
    vec![
        Scene::new("grid of a sphere", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 24), 1.0)))
            .creases(&creases),
        Scene::new("grid of a cuboid", s, Samples, Some(sampled(&block, cube_lattice(0.75 * s, 12), 1.0)))
            .creases(&creases),
        Scene::new("steep grid", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 12), 3.0))).creases(&creases),
        Scene::new("flat grid", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 12), 0.25))).creases(&creases),
        // Its inside reaches the box.
        Scene::new("grid of a piece of a cuboid", s, Samples, Some(sampled(&block, cube_lattice(0.4375 * s, 7), 1.0)))
            .creases(&[0.4375 * s, 0.375 * s, s]),
        Scene::new("sparse grid of a sphere", s, Samples, Some(sampled_in_bricks::<f32>(&ball, fine, 0.0625 * s)))
            .creases(&creases),
        Scene::new(
            "sparse grid of a cuboid in u16",
            s,
            Samples,
            Some(sampled_in_bricks::<u16>(&block, fine, 0.03125 * s)),
        )
        .creases(&creases),
        Scene::new("sparse grid of a sphere in u8", s, Samples, Some(sampled_in_bricks::<u8>(&ball, fine, 0.0625 * s)))
            .creases(&creases),
        Scene::new("turned grid", 1.5 * s, Samples, Some(turned)).creases(&[0.125 * s, 1.125 * s]),
        Scene::new(
            "bounded grid of a cuboid",
            s,
            Samples,
            Some(bounded(sampled(&block, cube_lattice(0.75 * s, 24), 1.0))),
        )
        .creases(&creases),
        Scene::new("turned sparse grid less a sphere", 1.5 * s, Samples, {
            let field = sampled_in_bricks::<u16>(&block, fine, 0.0625 * s);
            let placement = Similarity::new([0.125 * s, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap();
            Some(Difference(Placed { field, placement }, Sphere::new(0.25 * s).unwrap()))
        })
        .creases(&[0.125 * s, 1.125 * s]),
        Scene::new("union of two grids", s, Samples, {
            let block = sampled(&block, cube_lattice(0.75 * s, 12), 1.0);
            let placement = Similarity::new([0.125 * s, 0.0, 0.0], [0.1, 0.2, 0.3, 0.9], 0.75).unwrap();
            Some(Union(Placed { field: sampled(&ball, cube_lattice(s, 16), 1.0), placement }, block))
        })
        .creases(&creases),
    ]
}

fn distance_to_box(p: Point, half_extents: [f64; 3]) -> f64 {
    (p - Vector3::from_fn(|k, _| p[k].clamp(-half_extents[k], half_extents[k]))).norm()
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (p - (a + (b - a) * share)).norm()
}

fn distance_to_ring(p: Point, radius: f64) -> f64 {
    (p.xy().norm() - radius).hypot(p.z)
}

/// To the middle of a bowl's wall, which covers the polar angles from `rim` to π.
pub fn distance_to_bowl(p: Point, radius: f64, rim: f64) -> f64 {
    let angle = p.xy().norm().atan2(p.z).max(rim);
    Vector2::new(p.xy().norm() - radius * angle.sin(), p.z - radius * angle.cos()).norm()
}

/// Whether a bar bent as [`Horseshoe::new`] says holds a point of its plane.
pub fn in_horseshoe(p: Vector2<f64>, radius: f64, thickness: f64, bend: f64, leg: f64) -> bool {
    let angle = p.x.abs().atan2(-p.y);
    if angle <= bend && (p.norm() - radius).abs() <= 0.5 * thickness {
        return true;
    }
    let (outward, along) = (Vector2::new(bend.sin(), -bend.cos()), Vector2::new(bend.cos(), bend.sin()));
    let folded = Vector2::new(p.x.abs(), p.y);
    (0.0..=leg).contains(&folded.dot(&along)) && (folded.dot(&outward) - radius).abs() <= 0.5 * thickness
}

/// By the inverse of the rotation of a quaternion x, y, z, w of any length.
fn turn_back(p: Point, [x, y, z, w]: [f64; 4]) -> Point {
    let length = (x * x + y * y + z * z + w * w).sqrt();
    let (axis, w) = (-Vector3::new(x, y, z) / length, w / length);
    p + axis.cross(&(axis.cross(&p) + p * w)) * 2.0
}
