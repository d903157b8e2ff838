//! One thread is the caller's: the tasks of the process are counted all the while. A program of its own, as other tests start threads.
#![cfg(target_os = "linux")]

use std::fs;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use sdf_field::core::grid::owned::Layout;
use sdf_field::{BakeOptions, ContactOptions, Field, GridSize, MeshView, SignMethod, Threads};
use sdf_procedural::{Mesh, Sheet, SpikedBall};

fn view(mesh: &Mesh) -> MeshView<'_> {
    MeshView { points: &mesh.points, faces: &mesh.triangles }
}

fn task_count() -> usize {
    fs::read_dir("/proc/self/task").unwrap().count()
}

/// Calls `work` with what notes the names of calls during which there were more tasks, and says which they were.
fn starters(work: impl FnOnce(&mut dyn FnMut(String, &mut dyn FnMut()))) -> Vec<String> {
    let (most, is_done) = (AtomicUsize::new(0), AtomicBool::new(false));
    let mut names = vec![];
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_done.load(Ordering::Relaxed) {
                most.fetch_max(task_count(), Ordering::Relaxed);
            }
        });
        let before = task_count();
        work(&mut |name, call| {
            most.store(0, Ordering::Relaxed);
            call();
            if most.load(Ordering::Relaxed).max(task_count()) > before {
                names.push(name);
            }
        });
        is_done.store(true, Ordering::Relaxed);
    });
    names
}

#[test]
fn one_thread_starts_none() {
    let mesh = SpikedBall { levels: 3, radius: 0.7 }.mesh();
    let cloth =
        Sheet { cells: [50; 2], size: [2.0; 2], height: 0.2, bend: 0.1, floor: -1.0, holes: None, faces: None }.mesh();
    let points = &cloth.points[..];
    let one = Threads::ONE;
    let names = starters(|during| {
        for (layout, sign) in [
            (Layout::Dense, None),
            (Layout::Dense, Some(SignMethod::Winding)),
            (Layout::Sparse, None),
            (Layout::Sparse, Some(SignMethod::Winding)),
        ] {
            let mut during = |name: &str, call: &mut dyn FnMut()| during(format!("{name}, {layout:?} {sign:?}"), call);
            let options = BakeOptions {
                size: GridSize::Cells(80),
                layout,
                sign,
                keep_mesh: true,
                threads: one,
                ..BakeOptions::default()
            };
            let mut field = None;
            during("bake", &mut || field = Some(Field::bake(view(&mesh), &options).unwrap().field));
            let field = field.unwrap();
            let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("one-thread.sdf.h5");
            let mut bytes = vec![];
            during("save", &mut || one.install(|| field.save(&path)).unwrap());
            during("open", &mut || drop(one.install(|| Field::open(&path)).unwrap()));
            during("to_bytes", &mut || bytes = one.install(|| field.to_bytes()).unwrap());
            during("from_bytes", &mut || drop(one.install(|| Field::from_bytes(&bytes, "bytes")).unwrap()));
            let plain = ContactOptions { threads: one, ..ContactOptions::default() };
            for (name, options) in [("", &plain), ("exact ", &ContactOptions { exact: true, ..plain })] {
                during(&format!("{name}contacts"), &mut || drop(field.contacts(view(&cloth), options).unwrap()));
                during(&format!("{name}visit_contacts"), &mut || {
                    let visited = field.visit_contacts(view(&cloth), options, |_| ControlFlow::Continue(()));
                    assert!(visited.unwrap().is_continue());
                });
            }
            during("sample", &mut || drop(field.sample(points, one)));
            during("values", &mut || drop(field.values(points, one)));
            let lattice = *field.grid().unwrap().lattice();
            during("surface", &mut || drop(field.surface(0.0, &lattice, one)));
            during("mesh_distances", &mut || drop(Field::mesh_distances(view(&mesh), points, sign, one).unwrap()));
        }
    });
    assert!(names.is_empty(), "threads were started by {names:?}");
}
