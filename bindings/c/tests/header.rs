//! The header says what the library is: sizes, offsets, codes, functions. It is short, and good C99 and C++17.

use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::process::Command;

use sdf_field::ContactRow;
use sdftool::{SdfBakeOptions, SdfError, SdfInfo, SdfOverlapPoint, SdfPatch, SdfQuery, SdfResult, SdfTouch};

const STRICT: [&str; 4] = ["-Wall", "-Wextra", "-Werror", "-pedantic"];

fn header() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include/sdftool.h")
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// An expression of C and its value in Rust.
type Fact = (String, usize);

macro_rules! facts {
    ($type:ty, $name:literal: $($field:ident),+) => {{
        let mut facts: Vec<Fact> = vec![(format!("sizeof({})", $name), size_of::<$type>())];
        facts.push((format!("sizeof(struct {{ char c; {} s; }}) - sizeof({})", $name, $name), align_of::<$type>()));
        $(facts.push((format!("offsetof({}, {})", $name, stringify!($field)), offset_of!($type, $field)));)+
        facts
    }};
}

fn facts() -> Vec<Fact> {
    let mut facts = facts!(SdfBakeOptions, "SdfBakeOptions":
        voxel_size, resolution, layout, precision, sign, band, padding, threads);
    facts.extend(facts!(SdfQuery, "SdfQuery":
        margin, translation, rotation, elements, method, all_minima, budget, threads, lean, complete, exact, clusters, mesh_pose, margins));
    facts.extend(facts!(ContactRow, "SdfContact":
        weights, point, surface_point, normal, distance, lower_bound, slope, error_bound, shape_lower_bound, key, id, evaluations,
        vertices, feature_id, element, feature, status, padding));
    facts.extend(facts!(SdfInfo, "SdfInfo":
        min, max, spacing, error_bound, max_margin, slope_bound, nodes, layout));
    facts.extend(facts!(SdfTouch, "SdfTouch": time, contact));
    facts.extend(facts!(SdfOverlapPoint, "SdfOverlapPoint": point, normal, distances));
    facts.extend(facts!(SdfPatch, "SdfPatch": area, unknown, complete));
    facts.extend([("sizeof(SdfError)".to_owned(), size_of::<SdfError>())]);
    facts.extend([("sizeof(SdfResult)".to_owned(), size_of::<SdfResult>())]);
    let results = [
        ("SDF_OK", SdfResult::Ok),
        ("SDF_INVALID_ARGUMENT", SdfResult::InvalidArgument),
        ("SDF_FILE", SdfResult::File),
        ("SDF_TOO_SMALL", SdfResult::TooSmall),
        ("SDF_STOPPED", SdfResult::Stopped),
        ("SDF_BUG", SdfResult::Bug),
    ];
    facts.extend(results.map(|(name, result)| (name.to_owned(), result as usize)));
    let names = ContactRow::STATUS_NAMES.iter().enumerate().chain(ContactRow::ELEMENT_NAMES.iter().enumerate());
    facts.extend(names.map(|(code, name)| (format!("SDF_{}", name.to_uppercase()), code)));
    facts
}

#[test]
fn sizes_offsets_and_codes_are_those_of_the_library() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (source, program) = (folder.join("layout.c"), folder.join("layout"));
    let facts = facts();
    assert!(facts.len() > 50);
    let lines = facts.iter().map(|(expression, _)| format!("    printf(\"%d\\n\", (int)({expression}));\n"));
    let body: String = lines.collect();
    let text = format!("#include <stdio.h>\n#include \"sdftool.h\"\nint main(void) {{\n{body}    return 0;\n}}\n");
    std::fs::write(&source, text).unwrap();
    let include = header().parent().unwrap().to_owned();
    let mut compiler = Command::new("cc");
    run(compiler.arg("-std=c99").args(STRICT).arg("-I").arg(include).arg(&source).arg("-o").arg(&program));
    let found = run(&mut Command::new(&program));
    assert_eq!(found.lines().count(), facts.len());
    for ((expression, expected), found) in facts.iter().zip(found.lines()) {
        assert_eq!(found, expected.to_string(), "{expression}");
    }
}

#[test]
fn the_header_is_short_and_good_c99_and_cpp17() {
    let text = std::fs::read_to_string(header()).unwrap();
    assert!(text.lines().count() <= 120);
    for (compiler, standard, language) in [("cc", "-std=c99", "c"), ("c++", "-std=c++17", "c++")] {
        let mut command = Command::new(compiler);
        run(command.args([standard, "-fsyntax-only", "-x", language]).args(STRICT).arg(header()));
    }
}

/// Each function of the header has its twin, and each exported one stands in the header.
#[test]
fn the_header_names_the_functions_of_the_library() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let library: String =
        ["lib.rs", "motion.rs"].map(|file| std::fs::read_to_string(source.join(file)).unwrap()).concat();
    let text = std::fs::read_to_string(header()).unwrap();
    let code = text.split("*/").map(|piece| piece.split("/*").next().unwrap()).collect::<String>();
    let mut declared: Vec<&str> = code
        .split(['(', ' ', '*', '\n'])
        .zip(code.match_indices(['(', ' ', '*', '\n']).map(|(_, end)| end))
        .filter(|(word, end)| word.starts_with("sdf_") && *end == "(")
        .map(|(word, _)| word)
        .collect();
    let exported = library.split("#[unsafe(no_mangle)]\npub extern \"C\" fn ").skip(1);
    let mut exported: Vec<&str> = exported.map(|rest| rest.split('(').next().unwrap()).collect();
    declared.sort_unstable();
    exported.sort_unstable();
    assert!(exported.len() == 19 && declared == exported, "{declared:?} {exported:?}");
}
