//! `--device cuda`: on a machine without a card, on one without kernels, and with the driver of `gpu/stub`, which has the kernels on the
//! CPU.

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// The program with the stub as the driver.
fn on_stub(folder: &Folder, arguments: &str, variables: &[(&str, &str)]) -> Output {
    let driver = folder.at("driver");
    if !driver.exists() {
        std::fs::create_dir(&driver).unwrap();
        let test = std::env::current_exe().unwrap();
        let name = "libsdf_gpu_stub.so";
        let built = test.ancestors().skip(1).take(2).map(|at| at.join(name)).find(|path| path.exists());
        std::fs::copy(built.expect("the stub beside the tests"), driver.join("libcuda.so")).unwrap();
        folder.write("kernels.ptx", "// The stub has the kernels.\n");
    }
    let mut command = Command::new(PathBuf::from(env!("CARGO_BIN_EXE_sdftool")));
    command.args(arguments.split_whitespace()).current_dir(folder.path());
    command.env("LD_LIBRARY_PATH", driver).envs(variables.iter().copied());
    command.output().unwrap()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The one line of an error.
fn error(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(text.trim_end().lines().count(), 1, "{text}");
    text
}

fn ids(report: &Value) -> Vec<u64> {
    report["contacts"].as_array().unwrap().iter().map(|contact| contact["id"].as_u64().unwrap()).collect()
}

/// A ball, baked, and a sheet through it.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::cube().obj());
    folder.write("sheet.obj", Model::hills(12).obj());
    folder.done("bake ball.obj --res 16");
    folder.done("bake ball.obj --res 16 --layout sparse -o sparse.sdf.h5");
    folder
}

#[test]
fn contacts_on_a_card_are_those_of_the_cpu_to_seven_digits() {
    let folder = scene();
    for field in ["ball.sdf.h5", "sparse.sdf.h5"] {
        for method in ["auto", "fw", "pgd", "fw --lean"] {
            for pose in ["", "--translate 0.1,0.2,-0.1 --rotate 0.1,0.2,0.3,0.9"] {
                let query = format!("contacts sheet.obj {field} --margin 0.05 --method {method} {pose} --json");
                let by_card = json(&on_stub(&folder, &format!("{query} --device cuda --kernels kernels.ptx"), &[]));
                assert_eq!((&by_card["device"], &by_card["card"]), (&"cuda".into(), &"stub on the CPU".into()));
                let by_cpu = folder.json(query.trim_end_matches("--json"));
                assert_eq!(by_cpu["device"], "cpu");
                assert!(ids(&by_cpu).len() > 10, "{query}: {}", ids(&by_cpu).len());
                assert_eq!(ids(&by_card), ids(&by_cpu), "{query}");
                let pairs = by_card["contacts"].as_array().unwrap().iter().zip(by_cpu["contacts"].as_array().unwrap());
                for (card, cpu) in pairs {
                    let distance = |contact: &Value| contact["distance"].as_f64().unwrap();
                    // The cube has edges, where Frank-Wolfe ends a little above the minimum, and projected gradient descent may
                    // run out of steps on one side alone.
                    let difference = distance(card) - distance(cpu);
                    let below = if method == "pgd" { 0.02 } else { 1e-5 };
                    assert!(-below < difference && difference < 0.02, "{query}: {card} in place of {cpu}");
                }
            }
        }
    }
}

#[test]
fn lean_contacts_of_a_card_say_what_they_leave_out() {
    let folder = scene();
    let query = "contacts sheet.obj ball.sdf.h5 --margin 0.05 --lean --device cuda --kernels kernels.ptx";
    let report = json(&on_stub(&folder, &format!("{query} --method fw --json"), &[]));
    assert_eq!((&report["passed_cull"], &report["contacts"][0]["error_bound"]), (&Value::Null, &Value::Null));
    let rows = on_stub(&folder, &format!("{query} --method fw"), &[]);
    says(&String::from_utf8_lossy(&rows.stdout), &["not counted on a GPU"]);
    says(&error(&on_stub(&folder, query, &[])), &["lean contacts by auto", "CPU"]);
    let compare = "compare sheet.obj ball.sdf.h5 --margin 0.05 --rounds 1 --lean --device cuda --kernels kernels.ptx";
    let report = json(&on_stub(&folder, &format!("{compare} --json"), &[]));
    let rows = report["methods"].as_array().unwrap().iter().filter(|row| row["device"] == "cuda");
    assert!(rows.map(|row| row["method"].as_str().unwrap()).eq(["fw", "pgd"]), "{report}");
}

#[test]
fn what_a_card_leaves_undecided_is_counted_as_on_the_cpu() {
    let folder = scene();
    for (method, is_decided) in [("auto", true), ("certified", true), ("certified --iterations 1", false)] {
        let query = format!("contacts sheet.obj ball.sdf.h5 --margin 0.05 --method {method}");
        let on_card = format!("{query} --device cuda --kernels kernels.ptx");
        let undecided = &folder.json(&query)["undecided"];
        assert_eq!(&json(&on_stub(&folder, &format!("{on_card} --json"), &[]))["undecided"], undecided, "{query}");
        assert_eq!(*undecided == 0, is_decided, "{query}: {undecided}");
        let rows = on_stub(&folder, &on_card, &[]);
        let text = String::from_utf8_lossy(&rows.stdout);
        assert_eq!(text.contains("--complete on the CPU, which lists them"), !is_decided, "{text}");
    }
}

#[test]
fn coordinates_that_are_too_large_for_a_card_are_skipped_by_its_own_limit() {
    let folder = scene();
    folder.write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 2e18 0\nf 1 2 3\n");
    let query = "contacts far.obj ball.sdf.h5 --method fw --device cuda --kernels kernels.ptx";
    let rows = on_stub(&folder, query, &[]);
    says(&String::from_utf8_lossy(&rows.stdout), &["1 element with coordinates that are not finite or exceed 1e18"]);
    folder.write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 2e150 0\nf 1 2 3\n");
    says(&folder.done("contacts far.obj ball.sdf.h5 --method fw"), &["not finite or exceed 1e150"]);
}

#[test]
fn compare_has_a_row_for_each_method_of_the_card() {
    let folder = scene();
    let query = "compare sheet.obj ball.sdf.h5 --margin 0.05 --rounds 1 --device cuda --kernels kernels.ptx --json";
    let report = json(&on_stub(&folder, query, &[]));
    let rows = report["methods"].as_array().unwrap();
    let on = |device: &str| -> Vec<&Value> { rows.iter().filter(|row| row["device"] == device).collect() };
    let names: Vec<_> = on("cuda").iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["auto", "certified", "fw", "pgd", "newton"]);
    assert_eq!(on("cpu").len(), 10);
    let missed = |row: &&Value| row["missed"] != 0;
    assert!(!on("cuda").iter().take(2).any(missed), "{report}");
}

#[test]
fn what_is_missing_for_a_card_is_said_in_one_line() {
    let folder = scene();
    let query = "contacts sheet.obj ball.sdf.h5 --device cuda";
    // No machine that tests this has a driver where this points.
    let none = [("LD_LIBRARY_PATH", "")];
    let plain = on_stub(&folder, query, &none);
    if !String::from_utf8_lossy(&plain.stderr).contains("no GPU kernels") {
        says(&error(&plain), &["no CUDA driver", "libcuda.so"]);
    }
    says(&error(&on_stub(&folder, query, &[])), &["no GPU kernels", "kernels.ptx", ".ci/gpu.sh --out", "docs/gpu.md"]);
    says(&error(&on_stub(&folder, query, &[("SDF_STUB_CARDS", "0")])), &["no NVIDIA GPU"]);
    // A library of that name that is not the driver's.
    let (library, name) = (folder.at("driver/libcuda.so"), b"cuInit\0");
    let whole = std::fs::read(&library).unwrap();
    let mut part = whole.clone();
    let starts = (0..whole.len()).filter(|start| whole[*start..].starts_with(name));
    starts.for_each(|start| part[start] = b'x');
    std::fs::write(&library, part).unwrap();
    says(&error(&on_stub(&folder, query, &[])), &["not a whole CUDA driver", "cuInit", "CPU"]);
    std::fs::write(&library, whole).unwrap();
    let given =
        |kernels: &str, more: &str| error(&on_stub(&folder, &format!("{query} --kernels {kernels} {more}"), &[]));
    says(&given("missing.ptx", ""), &["missing.ptx", ".ci/gpu.sh"]);
    says(&given("sheet.obj", ""), &["sheet.obj", "kernels do not load"]);
    says(&given("kernels.ptx", "--all-minima"), &["all minima", "CPU"]);
    says(&given("kernels.ptx", "--elements edges --method newton"), &["this method on this field", "CPU"]);
    folder.write("plane.sdf.toml", "[field]\nshape = 'half_space'\nnormal = [0.0, 0.0, 1.0]\noffset = 0.0\n");
    let plane = "contacts sheet.obj plane.sdf.toml --device cuda --kernels kernels.ptx";
    says(&error(&on_stub(&folder, plane, &[])), &["this shape or combination", "CPU"]);
    says(&folder.misused("contacts sheet.obj ball.sdf.h5 --kernels kernels.ptx"), &["--kernels", "--device cuda"]);
    says(&folder.misused("contacts ball.sdf.h5 ball.sdf.h5 --device cuda"), &["--device needs a mesh"]);
}
