//! A bumpy ground, baked to a grid, and a box, a ball, a capsule and a mesh that fall on it: prints where they are, second by second,
//! and writes `sdf-parry-rest.obj`.

#[allow(dead_code, reason = "the test uses the rest of it")]
#[path = "../tests/scene/mod.rs"]
mod scene;

use parry3d::shape::TypedShape;
use scene::{Mesh, STEPS, bake, bumpy_slab, four_bodies_on};
use sdf_parry::Search;

fn main() -> std::io::Result<()> {
    let slab = bumpy_slab();
    let (mut world, bodies) = four_bodies_on(bake(&slab, 0.06), Search::Local);
    for second in 1..=10 {
        (0..STEPS).for_each(|_| world.step());
        let heights = bodies.iter().map(|(name, _, _, body)| {
            let body = world.body(*body);
            format!("{name} at {:.4}, {:.1e} fast", body.translation().z, body.linvel().length())
        });
        println!("{second:2} s: {}", heights.collect::<Vec<_>>().join("; "));
    }
    let mut file = String::new();
    let mut vertices = 0;
    let mut write = |name: &str, (points, faces): &Mesh| {
        file += &format!("o {name}\n");
        points.iter().for_each(|[x, y, z]| file += &format!("v {x} {y} {z}\n"));
        faces.iter().for_each(|face| {
            let [a, b, c] = face.map(|vertex| vertex + 1 + vertices);
            file += &format!("f {a} {b} {c}\n");
        });
        vertices += points.len() as u32;
    };
    write("ground", &slab);
    for (name, _, shape, body) in &bodies {
        let (points, faces) = match shape.as_typed_shape() {
            TypedShape::Ball(ball) => ball.to_trimesh(32, 16),
            TypedShape::Capsule(capsule) => capsule.to_trimesh(32, 16),
            TypedShape::Cuboid(cuboid) => cuboid.to_trimesh(),
            TypedShape::TriMesh(mesh) => (mesh.vertices().to_vec(), mesh.indices().to_vec()),
            _ => continue,
        };
        let pose = world.body(*body).position();
        let place = |point| pose.transform_point(point).to_array().map(f64::from);
        write(name, &(points.into_iter().map(place).collect(), faces));
    }
    std::fs::write("sdf-parry-rest.obj", file)?;
    println!("sdf-parry-rest.obj: the ground and the bodies, for any viewer");
    Ok(())
}
