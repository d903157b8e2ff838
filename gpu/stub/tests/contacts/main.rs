//! Contacts by the host code of `sdf-gpu` and the kernels on the CPU: are they those of `contact::<f32, …>`, bit for bit?
//!
//! Every test here runs in a process of its own, whose library path has the stub as `libcuda.so`: see [`with_stub`].
//! With the path of `kernels.ptx` in `SDF_STUB_KERNELS`, as `.ci/gpu.sh` has it, the stub runs that, instruction by instruction.

mod auto;
mod bounds;
mod failures;
mod far;
mod lean;
mod lent;
mod queries;
mod scenes;
mod second;

use std::path::{Path, PathBuf};
use std::process::Command;

use sdf_gpu::{Gpu, GpuError};

/// A folder with the stub as the driver, and a file that it takes for kernels.
struct Driver(tempfile::TempDir);

impl Driver {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let test = std::env::current_exe().unwrap();
        let name = "libsdf_gpu_stub.so";
        let built = test.ancestors().skip(1).take(2).map(|at| at.join(name)).find(|path| path.exists());
        std::fs::copy(built.expect("the stub beside the tests"), folder.path().join("libcuda.so")).unwrap();
        let kernels = folder.path().join("kernels.ptx");
        match std::env::var_os("SDF_STUB_KERNELS") {
            Some(ptx) => drop(std::fs::copy(ptx, kernels).unwrap()),
            None => std::fs::write(kernels, "// The stub has the kernels.\n").unwrap(),
        }
        std::fs::write(folder.path().join("broken.ptx"), "no kernels").unwrap();
        Self(folder)
    }
}

/// The driver's folder, in the process of one test.
const FOLDER: &str = "SDF_STUB_FOLDER";

/// Runs the test of this name with the stub as the driver: the library path counts when a process starts.
fn with_stub(name: &str, variables: &[(&str, &str)], test: impl FnOnce(&Path)) {
    if let Some(folder) = std::env::var_os(FOLDER) {
        return test(&PathBuf::from(folder));
    }
    let driver = Driver::new();
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", name, "--nocapture"]).envs(variables.iter().copied());
    command.env("LD_LIBRARY_PATH", driver.0.path()).env(FOLDER, driver.0.path());
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("1 passed"), "no test is called {name}: {text}");
}

fn gpu(folder: &Path) -> Gpu {
    Gpu::new(&folder.join("kernels.ptx")).unwrap()
}

#[test]
fn without_a_card_the_error_says_so() {
    with_stub("without_a_card_the_error_says_so", &[("SDF_STUB_CARDS", "0")], |folder| {
        let error = Gpu::new(&folder.join("kernels.ptx")).unwrap_err();
        assert!(matches!(error, GpuError::NoCard), "{error}");
    });
}

/// The function of the driver that a process of the next test lacks.
const WITHOUT: &str = "SDF_STUB_WITHOUT";

#[test]
fn a_driver_that_lacks_a_function_is_not_called() {
    let source = include_str!("../../src/lib.rs");
    let functions = source.lines().filter_map(|line| line.strip_prefix("    fn cu")?.split_once('('));
    let names: Vec<_> = functions.map(|(name, _)| format!("cu{name}")).collect();
    assert!(names.len() > 30 && names.contains(&"cuLaunchKernel".to_owned()), "{names:?}");
    // A process of a name has but that.
    let processes = if std::env::var_os(FOLDER).is_some() { 1 } else { names.len() };
    // The second version of this is for later versions of cudarc.
    for name in names.iter().filter(|name| *name != "cuEventElapsedTime_v2").take(processes) {
        with_stub("a_driver_that_lacks_a_function_is_not_called", &[(WITHOUT, name)], |folder| {
            let (without, path) = (std::env::var(WITHOUT).unwrap(), folder.join("libcuda.so"));
            let mut library = std::fs::read(&path).unwrap();
            let symbol = format!("\0{without}\0").into_bytes();
            let starts: Vec<_> =
                library.windows(symbol.len()).enumerate().filter(|(_, bytes)| *bytes == symbol).collect();
            let starts: Vec<_> = starts.into_iter().map(|(start, _)| start).collect();
            starts.iter().for_each(|start| library[start + 1] = b'x');
            std::fs::write(&path, library).unwrap();
            let error = Gpu::new(&folder.join("kernels.ptx")).unwrap_err();
            assert!(matches!(error, GpuError::IncompleteDriver(name) if name == without), "{error}");
            assert!(error.to_string().contains(&without) && error.to_string().lines().count() == 1, "{error}");
        });
    }
}

#[test]
fn a_file_that_is_not_of_kernels_is_named() {
    with_stub("a_file_that_is_not_of_kernels_is_named", &[], |folder| {
        for name in ["broken.ptx", "missing.ptx", "no\0file.ptx"] {
            let error = Gpu::new(&folder.join(name)).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(".ci/gpu.sh") && error.lines().count() == 1, "{error}");
        }
    });
}
