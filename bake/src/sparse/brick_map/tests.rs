use super::marked::Marked;
use super::*;
use crate::sparse::splat::frame::PlaneFrames;
use crate::testing::{random, random_vector};
use crate::{TriangleMesh, lattice_around};
use sdf_core::grid::sparse::brick_counts;

/// Some tetrahedra, and some triangles that make the mesh open.
fn mesh(tetrahedra: u32, triangles: u32, state: &mut u64) -> TriangleMesh {
    let (mut points, mut corners) = (vec![], vec![]);
    for part in 0..tetrahedra + triangles {
        let (center, size) = (random_vector(state), 0.02 + 0.3 * random(state).abs());
        let first = 4 * part;
        points.extend((0..4).map(|_| <[f64; 3]>::from(center + random_vector(state) * size)));
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|face: [u32; 3]| face.map(|c| first + c));
        corners.extend(&tetrahedron[..if part < tetrahedra { 4 } else { 1 }]);
    }
    TriangleMesh::new(&points, &corners).unwrap()
}

/// A closed surface that pseudo-normals sign.
fn solid(state: &mut u64) -> TriangleMesh {
    let (mut points, mut triangles) = (vec![], vec![]);
    let stretch = random_vector(state).map(|x| 1.0 + 0.6 * x);
    for i in 0..=8 {
        for j in 0..12 {
            let (up, round) = (std::f64::consts::PI * i as f64 / 8.0, std::f64::consts::TAU * j as f64 / 12.0);
            let radius = if i % 8 == 0 { 1.0 } else { 1.0 + 0.2 * random(state) };
            let at = [up.sin() * round.cos(), up.sin() * round.sin(), up.cos()];
            let round_pole = [0.0, 0.0, up.cos().signum()];
            let at = if i % 8 == 0 { round_pole } else { at.map(|x| radius * x) };
            points.push([at[0] * stretch.x, at[1] * stretch.y, at[2] * stretch.z]);
            let (next, below) = (12 * i + (j + 1) % 12, 12 * (i + 1) + j);
            if i < 8 {
                triangles.extend([[12 * i + j, below, next], [next, below, 12 * (i + 1) + (j + 1) % 12]]);
            }
        }
    }
    TriangleMesh::new(&points, &triangles).unwrap()
}

#[test]
fn a_solids_slots_are_marked_and_its_coarse_nodes_are_distances_inside_and_never_more_than_the_distance_outside() {
    let mut state = 83;
    println!("seed {state}");
    for (cells, band) in [(24.0, 3.0), (70.0, 3.0), (90.0, 1.0), (60.0, 12.0)] {
        let mesh = solid(&mut state);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 25).unwrap();
        let mesh = MeshDistance::new(&mesh, None);
        let spacing = lattice.spacing();
        let frames = PlaneFrames::new(mesh.tree(), mesh.outward(), spacing);
        let map = BrickMap::new(&mesh, &lattice, band * spacing, Some(&frames));
        assert!(map.is_solid, "{}", mesh.sign_reason());
        let distance = |node: [u32; 3]| mesh.nearest(lattice.node(node).into(), 0);
        let (mut far, mut deepest) = (0, 0.0_f32);
        for index in 0..map.slot_count() {
            let first = map.slot(index).map(|n| n * BRICK);
            let nodes = || (0..27).map(|n: usize| [n % 3, n / 3 % 3, n / 9].map(|n| [0, 3, 7][n]));
            let least = nodes().map(|step| distance(std::array::from_fn(|axis| first[axis] + step[axis])).distance);
            let least = least.fold(f64::INFINITY, f64::min);
            assert!(map.may_need_brick(index) || least > map.kept_within(), "slot {index}: {least}");
            far += usize::from(!map.may_need_brick(index));
            if map.may_need_brick(index) {
                continue;
            }
            // A slot without a brick: its nodes are interpolated.
            let corners = map.corner_magnitudes(map.slot(index));
            for step in nodes() {
                let node: [u32; 3] = std::array::from_fn(|axis| first[axis] + step[axis]);
                let nearest = distance(node);
                let interpolated = (0..8).map(|corner: usize| {
                    let weight = |axis: usize| {
                        let fraction = f64::from(step[axis]) / f64::from(BRICK);
                        if corner >> axis & 1 == 1 { fraction } else { 1.0 - fraction }
                    };
                    weight(0) * weight(1) * weight(2) * corners[corner]
                });
                let interpolated: f64 = interpolated.sum();
                let is_lower = nearest.is_inside || interpolated <= nearest.distance * (1.0 + 1e-6);
                assert!(is_lower, "{node:?}: {interpolated} for {}", nearest.distance);
            }
        }
        let nodes: Vec<[u32; 3]> = map.map_coarse_nodes(|node| node);
        for (index, node) in nodes.into_iter().enumerate() {
            for axis in 0..3 {
                let next: [u32; 3] = std::array::from_fn(|other| node[other] + u32::from(other == axis));
                if next[axis] <= map.counts()[axis] {
                    let next = corner_node(map.counts(), next, 0);
                    let step = (map.coarse.nodes[next].abs() - map.coarse.nodes[index].abs()).abs();
                    let is_on_side = map.is_node_inside(index) == map.is_node_inside(next);
                    assert!(!is_on_side || step <= 8.0 * spacing as f32, "{node:?} along {axis}: {step}");
                }
            }
            if map.slots_around(node).all(|slot| map.may_need_brick(slot)) {
                continue;
            }
            let nearest = distance(node.map(|n| n * BRICK));
            assert_eq!(map.is_node_inside(index), nearest.is_inside, "{node:?}");
            let at_brick = map.slots_around(node).any(|slot| map.may_need_brick(slot));
            let tolerance = if at_brick { 1e-6 * spacing } else { spacing };
            if nearest.is_inside {
                let wanted = map.inside_magnitude(nearest.distance as f32)
                    ..=map.inside_magnitude((nearest.distance + tolerance) as f32);
                assert!(wanted.contains(&map.coarse.nodes[index].abs()), "{node:?}");
                deepest = deepest.max(map.coarse.nodes[index].abs());
            }
        }
        assert!(far > 100 && (cells < 70.0 || f64::from(deepest) > 8.0 * spacing), "{far} {deepest}");
    }
}

/// Layer by layer, with triangles kept for near slots alone, a solid has the coarse grid that it has at once; and its magnitudes are
/// limited as those of each side by themselves are, with the other infinite.
#[test]
fn a_solids_coarse_grid_is_the_same_by_layers_and_its_sides_are_limited_by_themselves() {
    let mut state = 71;
    println!("seed {state}");
    for (cells, band) in [(24.0, 3.0), (70.0, 3.0), (90.0, 1.0), (60.0, 12.0)] {
        let mesh = solid(&mut state);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 25).unwrap();
        let mesh = MeshDistance::new(&mesh, None);
        let spacing = lattice.spacing();
        let frames = PlaneFrames::new(mesh.tree(), mesh.outward(), spacing);
        let empty = || BrickMap::empty(brick_counts(&lattice), spacing, band * spacing);
        let nodes = |max_listed, window| {
            let map = empty();
            let mut marked = Marked::new(&map, &mesh, &lattice, &frames, max_listed);
            (map.solid_nodes(&mut marked, window), marked.into_near())
        };
        let (wanted, near) = nodes(usize::MAX, usize::MAX);
        for window in [1, 1000, 3000] {
            let (found, found_near) = nodes(0, window);
            assert!(found.iter().map(|node| node.to_bits()).eq(wanted.iter().map(|node| node.to_bits())), "{window}");
            assert!((0..near.len()).all(|slot| near.contains(slot) == found_near.contains(slot)));
        }
        let (mut by_signs, mut by_sides) = (empty(), empty());
        by_signs.set_solid_nodes(&mesh, wanted.clone());
        let inside: Vec<bool> = wanted.iter().map(|node| node.is_sign_negative()).collect();
        by_sides.set_magnitudes(&mesh, wanted.iter().map(|node| node.abs()).collect(), &inside);
        assert_eq!(by_signs.coarse.nodes, by_sides.coarse.nodes);
        assert!(by_signs.coarse.nodes != wanted, "nothing was lowered");
    }
}

#[test]
fn far_from_crossed_slots_magnitudes_interpolate_to_no_more_than_the_distance_from_them() {
    let mut state = 97;
    println!("seed {state}");
    let mesh = solid(&mut state);
    let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 24.0, 60).unwrap();
    let mesh = MeshDistance::new(&mesh, None);
    let spacing = lattice.spacing();
    let frames = PlaneFrames::new(mesh.tree(), mesh.outward(), spacing);
    let (map, mut marked) = BrickMap::marked(&mesh, &lattice, 3.0 * spacing, Some(&frames)).unwrap();
    marked.look_at(&map, 0..map.counts()[2] as usize + 1);
    let middle_gaps = marked.middle_gaps(&map);
    let slots: Vec<usize> = (0..middle_gaps.len()).collect();
    let crossed: Vec<[u32; 3]> =
        slots.iter().filter(|slot| middle_gaps[**slot] == 0.0).map(|slot| map.slot(*slot)).collect();
    let mut count = 0;
    for slot in slots.into_iter().filter(|slot| marked.gap(*slot) >= 16.0) {
        let first = map.slot(slot);
        let values: [f64; 8] = std::array::from_fn(|corner| {
            let node = std::array::from_fn(|axis| first[axis] + (corner as u32 >> axis & 1));
            f64::from(marked.outside_magnitude(&map, &marked.node(&map, node), 0.0)) / spacing
        });
        for step in (0..27).map(|n: usize| [n % 3, n / 3 % 3, n / 9].map(|n| 0.5 * n as f64)) {
            let weight = |corner: usize, axis: usize| {
                if corner >> axis & 1 == 1 { step[axis] } else { 1.0 - step[axis] }
            };
            let value: f64 = (0..8).map(|c| weight(c, 0) * weight(c, 1) * weight(c, 2) * values[c]).sum();
            let distance_sq = |other: &[u32; 3]| {
                let along = |axis: usize| {
                    let at = f64::from(first[axis]) + step[axis] - f64::from(other[axis]);
                    (-at).max(at - 1.0).max(0.0)
                };
                (0..3).map(|axis| along(axis).powi(2)).sum::<f64>()
            };
            let distance = 8.0 * crossed.iter().map(distance_sq).fold(f64::INFINITY, f64::min).sqrt();
            assert!(value <= distance * (1.0 + 1e-6), "{first:?} {step:?}: {value} of {distance}");
            count += 1;
        }
    }
    assert!(count > 1000, "{count}");
}

#[test]
fn distances_from_crossed_slots_are_those_to_each_of_them_and_steps_are_limited() {
    let mut state = 89;
    for counts in [[1, 1, 1], [5, 7, 3], [20, 9, 14]] {
        let count = counts.iter().product::<usize>();
        let mut crossed: Vec<bool> = (0..count).map(|_| random(&mut state) > 0.9).collect();
        crossed[count / 2] = true;
        use transform::From;
        for (from, more) in [(From::Slots, 0), (From::Corners, 1), (From::Middles, 0)] {
            let ends = counts.map(|n| n + more);
            let bits = SlotBits::of(count, |slot| crossed[slot]);
            let layers = |layers| transform::distances(pulp::Arch::new(), &bits, counts, from, layers);
            let mut found = layers(0..ends[2]);
            for window in [0..1, ends[2] / 2..ends[2], ends[2] - 1..ends[2]] {
                let layer = ends[0] * ends[1];
                assert_eq!(layers(window.clone()), found[window.start * layer..window.end * layer], "{window:?}");
            }
            let at = |index: usize, [x, y, _]: [usize; 3]| [index % x, index / x % y, index / x / y];
            for (index, found) in found.iter().enumerate() {
                let here = at(index, ends);
                let gaps = crossed.iter().enumerate().filter(|(_, crossed)| **crossed).map(|(other, _)| {
                    let there = at(other, counts);
                    let gap = |axis: usize| {
                        // From the first and the last point of the slot, its corner or its middle to the other slot's.
                        let (here, there) = (here[axis] as f32, there[axis] as f32);
                        let [first, last] = match from {
                            From::Slots => [here, here + 1.0],
                            From::Corners => [here, here],
                            From::Middles => [here + 0.5, here + 0.5],
                        };
                        (there - last).max(first - there - 1.0).max(0.0)
                    };
                    (0..3).map(|axis| gap(axis).powi(2)).sum::<f32>()
                });
                let least = gaps.fold(f32::INFINITY, f32::min);
                assert_eq!(*found, least.sqrt(), "{here:?} of {counts:?}");
            }
            let before = found.clone();
            transform::limit_steps(pulp::Arch::new(), &mut found, ends, 0.5);
            for (index, value) in found.iter().enumerate() {
                let here = at(index, ends);
                let limits = before.iter().enumerate().map(|(other, value)| {
                    let there = at(other, ends);
                    value + 0.5 * (0..3).map(|axis| here[axis].abs_diff(there[axis])).sum::<usize>() as f32
                });
                assert_eq!(*value, limits.fold(f32::INFINITY, f32::min), "{here:?} of {counts:?}");
            }
        }
    }
}

#[test]
fn a_marked_map_signed_by_winding_numbers_has_the_sides_of_one_that_is_measured_and_never_more_than_the_distance() {
    let mut state = 53;
    println!("seed {state}");
    for (tetrahedra, triangles, cells) in [(9, 0, 150.0), (0, 40, 90.0), (3, 1, 200.0)] {
        let mesh = mesh(tetrahedra, triangles, &mut state);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 20).unwrap();
        let mesh = MeshDistance::new(&mesh, None);
        let (spacing, band) = (lattice.spacing(), 3.0 * lattice.spacing());
        let frames = PlaneFrames::new(mesh.tree(), None, spacing);
        let (map, measured) =
            (BrickMap::new(&mesh, &lattice, band, Some(&frames)), BrickMap::by_middles(&mesh, &lattice, band));
        let sides = |map: &BrickMap| map.coarse.nodes.iter().map(|node| node.is_sign_negative()).collect::<Vec<_>>();
        assert_eq!(sides(&map), sides(&measured));
        for index in 0..map.slot_count() {
            assert_eq!(map.is_inside(index), measured.is_inside(index), "slot {index}");
            let (found, exact) = (map.distances[index].abs(), measured.distances[index].abs());
            assert!(if map.may_need_brick(index) { found == exact } else { found <= exact }, "slot {index}");
            // Whatever is within K of a node was found within K + R of the middle.
            assert!(map.may_need_brick(index) <= measured.may_need_brick(index), "slot {index}");
        }
        let windings = map.windings.as_ref().unwrap();
        let mut deep = 0;
        for (index, node) in map.map_coarse_nodes(|node| node).into_iter().enumerate() {
            let distance = mesh.nearest(lattice.node(node.map(|n| n * BRICK)).into(), 0).distance as f32;
            assert!(windings.node_distances[index].abs() <= distance * (1.0 + f32::EPSILON), "{node:?}");
            let magnitude = map.coarse.nodes[index].abs();
            if map.is_node_inside(index) {
                let most = map.inside_magnitude(distance + spacing as f32);
                assert!((map.inside_magnitude(distance)..=most).contains(&magnitude), "{node:?}");
                continue;
            }
            let most = distance.max(map.exact_within() as f32);
            assert!(magnitude <= most * (1.0 + f32::EPSILON) + spacing as f32, "{node:?}: {magnitude} of {distance}");
            deep += usize::from(magnitude > 8.0 * spacing as f32);
        }
        assert!(deep > 0);
    }
}

#[test]
fn distances_and_magnitudes_are_those_of_every_node_searched_by_itself() {
    let mut state = 47;
    println!("seed {state}");
    for (tetrahedra, triangles, cells) in [(1, 0, 20.0), (1, 0, 150.0), (9, 0, 150.0), (0, 40, 90.0), (3, 1, 200.0)] {
        let mesh = mesh(tetrahedra, triangles, &mut state);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 2).unwrap();
        let mesh = MeshDistance::new(&mesh, None);
        let map = BrickMap::by_middles(&mesh, &lattice, 3.0 * lattice.spacing());
        for index in 0..map.slot_count() {
            let at = middle(&lattice, map.slot(index).map(|n| n as usize));
            let wanted = mesh.nearest(at, 0).distance as f32;
            assert_eq!(map.distances[index].abs(), wanted, "slot {index}");
        }
        let mut tilted = 0;
        let nodes: Vec<[u32; 3]> = map.map_coarse_nodes(|node| node);
        for (index, node) in nodes.into_iter().enumerate() {
            let at = Vector3::from(lattice.node(node.map(|n| n * BRICK)));
            let distance = mesh.nearest(at, 0).distance as f32;
            let is_inside = mesh.signed_distance(at.into()).is_sign_negative();
            let wanted = if is_inside { map.inside_magnitude(distance) } else { map.magnitude(node, distance) };
            assert_eq!(map.coarse.nodes[index].abs(), wanted, "{node:?}");
            tilted += usize::from(!is_inside && map.coarse.nodes[index].abs() > map.magnitude(node, 0.0));
            if let Some(windings) = &map.windings {
                assert!(windings.node_distances[index].abs() <= distance * (1.0 + f32::EPSILON), "{node:?}");
            }
        }
        assert!(tilted > 0, "{tetrahedra} {triangles}");
    }
}
