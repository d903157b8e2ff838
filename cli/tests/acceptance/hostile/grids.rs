//! Damaged grid files.

use sdf_procedural::random::Random;

use super::{bad_field, readers_of, scene};
use crate::folder::says;

#[test]
fn a_grid_file_with_a_flipped_bit_is_refused_or_equal_in_content() {
    for layout in ["dense", "sparse --precision u8"] {
        check_flipped_bits(layout);
    }
}

fn check_flipped_bits(layout: &str) {
    let folder = scene();
    folder.done(&format!("bake cube.obj --res 8 --layout {layout}"));
    let good = folder.read("cube.sdf.h5");
    folder.write("points.csv", "0.1,0.2,0.3\n0.6,1.2,-0.2\n-0.4,0.1,0.1\n1.4,1.4,1.4\n");
    let [eval, info] = ["eval damaged.sdf.h5 --points points.csv", "info damaged.sdf.h5"];
    folder.write("damaged.sdf.h5", &good);
    let expected = [eval, info].map(|words| folder.done(words));
    // This command reads the whole file, the others do not.
    let surface = "surface damaged.sdf.h5 -o surface.obj";
    folder.done(surface);
    let expected_surface = folder.read("surface.obj");
    let mut random = Random::new(3);
    let (mut refusals, flips) = (0, 50);
    for _ in 0..flips {
        let mut damaged = good.clone();
        let at = random.below(damaged.len());
        damaged[at] ^= 1 << random.below(8);
        folder.write("damaged.sdf.h5", &damaged);
        if folder.sdftool(eval).output().unwrap().status.success() {
            assert_eq!(folder.done(eval), expected[0], "byte {at}");
            // How many bytes a part takes is told by the file's index. It is not content, and a chunk that nothing reads is not checked.
            let content = |text: &str| -> Vec<String> {
                text.lines().filter(|line| !line.trim_start().starts_with("file ")).map(str::to_owned).collect()
            };
            let printed = folder.sdftool(info).output().unwrap();
            if printed.status.success() {
                assert_eq!(content(&String::from_utf8_lossy(&printed.stdout)), content(&expected[1]), "byte {at}");
            }
        } else {
            let line = folder.refused(eval);
            says(&line, &["damaged.sdf.h5: "]);
            // The others say the same, or do not read the damaged chunk.
            for words in readers_of("damaged.sdf.h5") {
                if !folder.sdftool(&words).output().unwrap().status.success() {
                    assert_eq!(folder.refused(&words), line, "byte {at}");
                }
            }
        }
        if folder.sdftool(surface).output().unwrap().status.success() {
            assert!(folder.read("surface.obj") == expected_surface, "byte {at}");
        } else {
            says(&folder.refused(surface), &["damaged.sdf.h5: "]);
            refusals += 1;
        }
    }
    // The rest of the file is unused space.
    assert!(refusals > flips / 10, "{refusals}");
}

#[test]
fn a_grid_file_cut_short_is_refused() {
    let folder = scene();
    let good = folder.read("cube.sdf.h5");
    for cut in (0..good.len()).step_by(good.len() / 40).chain([7, 8, 9, 95, 96, good.len() - 1]) {
        folder.write("cut.sdf.h5", &good[..cut]);
        bad_field(&folder, "cut.sdf.h5");
        folder.refused("info cut.sdf.h5");
    }
}
