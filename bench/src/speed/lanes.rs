//! Contacts in f32 beside f64: culled and searched by `contact::batch`, in lanes on a dense grid, whose samples are f32 for both.

use anyhow::{Context, Result, bail, ensure};
use pulp::NullaryFnOnce;
use sdf_core::contact::{Contact, Element, Outcome, batch};
use sdf_core::grid::owned::OwnedStorage;
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Float, Simplex};

use super::contacts::ContactScene;
use super::round_robin::{RoundRobin, RunResult, Work, timed};
use super::row::Row;

const GROUP: &str = "lanes";

/// Largest difference of the contacts that are found in f32 and in f64, as a fraction: faces that end at the margin.
const MAX_DIFFERENCE: f64 = 0.01;

pub fn measure(quick: bool, turns: &mut RoundRobin) -> Result<()> {
    let scene = &ContactScene::built_in(if quick { 48 } else { 256 })?;
    let grid = scene.field.grid().context("a field without a grid")?;
    let OwnedStorage::Dense(samples) = grid.storage() else { bail!("a grid that is not dense") };
    let grid = &grid.with_storage(samples);
    turns.measure(vec![
        work::<f64, 8>(scene, grid, "f64"),
        work::<f32, 8>(scene, grid, "f32"),
        work::<f32, 16>(scene, grid, "f32"),
    ])?;
    let rows = turns.rows.iter().filter(|row| row.group == GROUP);
    let counts: Vec<f64> = rows.filter_map(|row| row.contacts).map(|count| count as f64).collect();
    let is_close = |count: &f64| (count - counts[0]).abs() <= MAX_DIFFERENCE * counts[0];
    ensure!(counts.iter().all(is_close), "f64 and f32 find other contacts: {counts:?}");
    Ok(())
}

fn work<'a, R: Float + Send + Sync + 'a, const L: usize>(
    scene: &ContactScene,
    field: &'a (impl EnclosedSdf + Sync),
    number: &str,
) -> Work<'a> {
    let elements: Vec<Element<R, 3>> = elements(scene);
    let row = Row {
        group: GROUP,
        work: format!("contacts of {} by fw in {L} lanes of {number}", scene.name),
        triangles: elements.len(),
        resolution: scene.resolution,
        threads: 1,
        units: elements.len() as f64,
        unit: "faces",
        ..Row::default()
    };
    let margin = R::from_f64(scene.margin);
    let run = move || {
        let query = Query::<_, _, L> { field, margin, elements: &elements };
        let (contacts, seconds) = timed(1, || with_avx2(&query))?;
        Ok(RunResult { contacts: Some(contacts.len()), ..RunResult::timed(seconds) })
    };
    Work { row, size: 1.0, run: Box::new(run) }
}

/// Faces of a scene's mesh, with corners rounded to the number type.
fn elements<R: Float>(ContactScene { mesh, .. }: &ContactScene) -> Vec<Element<R, 3>> {
    let corner = |vertex: u32| Vector3::from(mesh.points[vertex as usize].map(R::from_f64));
    let element =
        |(id, vertices): (u32, [u32; 3])| Element { id, vertices, simplex: Simplex { corners: vertices.map(corner) } };
    (0..).zip(mesh.triangles.iter().copied()).map(element).collect()
}

/// Faces to be searched in `L` lanes.
struct Query<'a, F, R: Float, const L: usize> {
    field: &'a F,
    margin: R,
    elements: &'a [Element<R, 3>],
}

impl<F: EnclosedSdf, R: Float, const L: usize> NullaryFnOnce for &Query<'_, F, R, L> {
    type Output = Vec<Contact<R>>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Query { field, margin, elements } = *self;
        let mut contacts = vec![];
        batch::contacts::<_, _, _, _, 3, L>(field, &FrankWolfe::default(), margin, elements, |_, outcome| {
            if let Outcome::Contact(contact) = outcome {
                contacts.push(contact);
            }
        });
        contacts
    }
}

/// Runs work with the instructions that sdf-field searches with, as far as it is inlined.
fn with_avx2<W: NullaryFnOnce>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(vectors) = pulp::x86::V3::try_new() {
        return vectors.vectorize(work);
    }
    work.call()
}
