//! Queries: which kernels find the contacts of a mesh, and how are they read back?
//!
//! Field, elements and buffers go to the card once. From frame to frame only what changed does: new points, or a pose of 96 bytes.
//!
//! | kernel | runs |
//! |---|---|
//! | `place_points` | where the field has a pose: the points in its frame |
//! | `cull`, `search`, `report`, or `contact` for all three | always |
//! | `search` by the certified method | over what the first search did not settle, if [`Unsettled`] wants it |
//! | `place_contacts` | where the field has a pose: the contacts in the world |

use cudarc::driver::{CudaFunction, CudaSlice, DevicePtr, PushKernelArg};
use sdf_core::contact::Contact;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};

use crate::abi::{Frame, PoseParams, SURVIVOR_BYTES, SearchParams, TEAM, counter};
use crate::device::blocks;
use crate::options::{Method, QueryOptions, Stages, Unsettled};
use crate::record::contact;
use crate::{CardContacts, Gpu, GpuError, GpuField, GpuMesh, LentRows};

/// The contacts of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GpuContacts {
    /// In the order of their elements.
    pub contacts: Vec<Contact<f32>>,
    /// Elements that were searched; 0 of a fused query, which does not count them.
    pub searched_count: u32,
    /// Elements with coordinates or answers that are not finite.
    pub skipped_count: u32,
    /// Elements that the first search did not settle, whatever became of them. With [`Unsettled::Keep`] 0, but for two:
    /// [`Method::Certified`], and [`Stages::LeanSeparate`], where a search of one step did not settle them, and all are searched a second
    /// time.
    pub unsettled_count: u32,
    /// Elements that a certified search left open: its evaluations ended before it knew of a contact to within the tolerance, or that
    /// there is none. 0 where no search is certified.
    pub open_count: u32,
    /// Ids in rising order of those that are left open, with [`Unsettled::List`] and [`Unsettled::CertifyThenList`]: there may be contacts on them beside `contacts`.
    pub unsettled: Vec<u32>,
}

/// A mesh and a field on the card, and the kernels that find where they touch.
#[derive(Debug)]
pub struct GpuQuery {
    gpu: Gpu,
    field: GpuField,
    mesh: GpuMesh,
    options: QueryOptions,
    pose: Option<PoseParams>,
    place_points: CudaFunction,
    place_contacts: CudaFunction,
    steps: Vec<Step>,
}

/// A launch of a query.
#[derive(Debug)]
struct Step {
    kernel: CudaFunction,
    frame: Frame,
    /// Knobs, for the kernels that have a method.
    search: Option<SearchParams>,
    threads: u32,
}

impl GpuQuery {
    /// Looks up the kernels. Nothing runs yet.
    pub fn new(gpu: &Gpu, field: &GpuField, mesh: GpuMesh, options: &QueryOptions) -> Result<Self, GpuError> {
        gpu.check_owner(&field.stream, "field")?;
        gpu.check_owner(mesh.counters.stream(), "mesh")?;
        let mut query = Self {
            gpu: gpu.clone(),
            field: field.clone(),
            place_points: gpu.kernel("place_points")?,
            place_contacts: gpu.kernel("place_contacts")?,
            mesh,
            options: *options,
            pose: None,
            steps: vec![],
        };
        query.steps = query.steps()?;
        Ok(query)
    }

    /// Replaces the points of the mesh, in the world.
    pub fn set_points(&mut self, points: &[[f32; 3]]) -> Result<(), GpuError> {
        self.mesh.set_points(&self.gpu, points)?;
        self.show_points();
        Ok(())
    }

    /// Replaces the points of the mesh by some that are on the card already, and are read where they are.
    pub fn lend_points(&mut self, points: LentRows) -> Result<(), GpuError> {
        self.mesh.lend_points(points)?;
        self.show_points();
        Ok(())
    }

    /// Changes what becomes of elements that the search does not settle.
    pub fn set_unsettled(&mut self, unsettled: Unsettled) -> Result<(), GpuError> {
        let before = std::mem::replace(&mut self.options.unsettled, unsettled);
        match self.steps() {
            Ok(steps) => self.steps = steps,
            Err(error) => {
                self.options.unsettled = before;
                return Err(error);
            }
        }
        Ok(())
    }

    /// Faces, edges or vertices of the mesh.
    pub fn element_count(&self) -> usize {
        self.mesh.element_count as usize
    }

    /// The points of the mesh, in the world, as they are on the card.
    pub fn read_points(&self) -> Result<Vec<[f32; 3]>, GpuError> {
        self.mesh.read_points(&self.gpu)
    }

    /// The vertices of the elements as they are on the card, three for each face and two for each edge.
    pub fn read_elements(&self) -> Result<Vec<u32>, GpuError> {
        let mut indices = self.gpu.stream.clone_dtoh(&self.mesh.elements)?;
        indices.truncate(self.mesh.index_count());
        Ok(indices)
    }

    /// Moves the field: `None` puts it back into its own frame.
    pub fn set_pose(&mut self, pose: Option<&Rigid>) -> Result<(), GpuError> {
        let needs_room = pose.is_some() && self.mesh.local_points.is_none();
        if needs_room {
            let numbers = (3 * self.mesh.points.count()).max(1);
            // SAFETY: a kernel writes all of it before another reads it.
            self.mesh.local_points = Some(unsafe { self.gpu.stream.alloc(numbers)? });
        }
        self.pose = pose.map(params);
        self.show_points();
        Ok(())
    }

    /// Tells the kernels where the points are.
    fn show_points(&mut self) {
        let points = self.points();
        self.steps.iter_mut().for_each(|step| step.frame.points = points);
    }

    /// The contacts: those of `sdf_core::contact::contact::<f32, …>` on the points in the field's frame, bit for bit, in the order of
    /// elements.
    pub fn contacts(&mut self) -> Result<GpuContacts, GpuError> {
        let found = (0..self.stage_count()).try_for_each(|stage| self.launch(stage)).and_then(|()| self.read());
        self.finished(found)
    }

    /// The same contacts, left on the card; `None` if an element is left to the host.
    pub fn contacts_on_card(&mut self) -> Result<Option<CardContacts>, GpuError> {
        let found = (0..self.stage_count()).try_for_each(|stage| self.launch(stage)).and_then(|()| {
            let counters = self.gpu.stream.clone_dtoh(&self.mesh.counters)?;
            let is_open = self.open_list().is_some_and(|(_, counter)| counters[counter as usize] > 0);
            let count = counters[counter::HITS as usize] as usize;
            (!is_open).then(|| CardContacts::copy(&self.gpu, &self.mesh.contacts, count)).transpose()
        });
        self.finished(found)
    }

    /// After it no kernel reads lent points, whatever failed.
    pub(crate) fn finished<T>(&self, found: Result<T, GpuError>) -> Result<T, GpuError> {
        if found.is_err() {
            let _ = self.gpu.stream.synchronize();
        }
        found
    }

    /// The contacts that the last query left in the card's memory.
    fn read(&self) -> Result<GpuContacts, GpuError> {
        let stream = &self.gpu.stream;
        let mesh = &self.mesh;
        let counters = stream.clone_dtoh(&mesh.counters)?;
        let count = |counter: u32| counters[counter as usize];
        let hit_count = count(counter::HITS) as usize;
        let records = if hit_count == 0 { vec![] } else { stream.clone_dtoh(&mesh.contacts.slice(0..hit_count))? };
        let mut contacts: Vec<_> = records.iter().filter_map(contact).collect();
        contacts.sort_unstable_by_key(|contact| contact.element);
        let is_certified = self.options.method == Method::Certified;
        let unsettled_count = count(if is_certified { counter::OPEN } else { counter::UNSETTLED });
        let mut unsettled = vec![];
        if let Some((list, counter)) = self.open_list()
            && count(counter) > 0
        {
            let words = count(counter) as usize * SURVIVOR_BYTES / 8;
            let list = stream.clone_dtoh(&list.slice(0..words))?;
            // The element is the first half of a survivor.
            unsettled.extend(list.iter().map(|survivor| *survivor as u32));
            unsettled.sort_unstable();
        }
        Ok(GpuContacts {
            contacts,
            searched_count: count(counter::SURVIVORS),
            skipped_count: count(counter::SKIPPED),
            unsettled_count,
            open_count: count(counter::OPEN),
            unsettled,
        })
    }

    /// Where the elements stand that are left to the host, and their counter; `None` if none is.
    fn open_list(&self) -> Option<(&CudaSlice<u64>, u32)> {
        match (self.options.unsettled, self.options.method) {
            (Unsettled::List, Method::Certified) => Some((&self.mesh.unsettled, counter::OPEN)),
            (Unsettled::List, _) => Some((&self.mesh.unsettled, counter::UNSETTLED)),
            // The second launch no longer needs the survivors of the cull.
            (Unsettled::CertifyThenList { .. }, _) => Some((&self.mesh.survivors, counter::OPEN)),
            _ => None,
        }
    }

    /// Address of the points that the stages read.
    fn points(&self) -> u64 {
        match (&self.pose, &self.mesh.local_points) {
            (Some(_), Some(local)) => local.device_ptr(&self.gpu.stream).0,
            _ => self.mesh.points.address(&self.gpu),
        }
    }

    fn frame(&self) -> Frame {
        let (mesh, stream) = (&self.mesh, &self.gpu.stream);
        let is_kept = self.options.unsettled == Unsettled::Keep;
        Frame {
            points: self.points(),
            elements: mesh.elements.device_ptr(stream).0,
            survivors: mesh.survivors.device_ptr(stream).0,
            hits: mesh.hits.device_ptr(stream).0,
            contacts: mesh.contacts.device_ptr(stream).0,
            unsettled: if is_kept { 0 } else { mesh.unsettled.device_ptr(stream).0 },
            counters: mesh.counters.device_ptr(stream).0,
            element_count: mesh.element_count,
            survivor_counter: counter::SURVIVORS,
            margin: self.options.margin,
            unused: 0,
        }
    }

    /// All launches but those for a pose.
    fn steps(&self) -> Result<Vec<Step>, GpuError> {
        let (elements, kind, options) = (self.mesh.kind, self.field.kind, &self.options);
        let (method, frame) = (options.method.name(), self.frame());
        let first =
            SearchParams { tolerance: options.method.tolerance(options), iterations: options.iterations, unused: 0 };
        let step = |name: String, frame, search| match self.gpu.find_kernel(&name)? {
            Some(kernel) => {
                let has_team = name.ends_with("_certified") && kind != "shapes";
                let threads_per_element = if has_team { TEAM } else { 1 };
                let threads = self.mesh.element_count.checked_mul(threads_per_element);
                let threads = threads.ok_or(GpuError::Unsupported("a certified search of so many elements at once"))?;
                Ok(Step { kernel, frame, search, threads })
            }
            None if name.starts_with("lean_") => {
                Err(GpuError::Unsupported("lean contacts by this method on this field and kind of element"))
            }
            None => Err(GpuError::Unsupported("this method on this field and kind of element")),
        };
        match (options.stages, options.unsettled) {
            (Stages::Fused, Unsettled::Keep) => {
                return Ok(vec![step(format!("contact_{elements}_{kind}_{method}"), frame, Some(first))?]);
            }
            (Stages::Lean, Unsettled::Keep) => {
                return Ok(vec![step(format!("lean_{elements}_{kind}_{method}"), frame, Some(first))?]);
            }
            (Stages::LeanSeparate, Unsettled::Keep) => {
                let search = format!("lean_search_{elements}_{kind}_{method}");
                let unsettled = self.mesh.unsettled.device_ptr(&self.gpu.stream).0;
                let quick = SearchParams { iterations: first.iterations.min(1), ..first };
                let rest = Frame { survivors: unsettled, survivor_counter: counter::UNSETTLED, ..frame };
                return Ok(vec![
                    step(format!("lean_cull_{elements}_{kind}"), frame, None)?,
                    step(search.clone(), Frame { unsettled, ..frame }, Some(quick))?,
                    step(search, rest, Some(first))?,
                ]);
            }
            (Stages::Fused | Stages::Lean | Stages::LeanSeparate, _) => {
                return Err(GpuError::Unsupported("a second search after one kernel for all"));
            }
            (Stages::Separate, _) => {}
        }
        let mut steps = vec![
            step(format!("cull_{elements}_{kind}"), frame, None)?,
            step(format!("search_{elements}_{kind}_{method}"), frame, Some(first))?,
        ];
        if let Unsettled::Certify { evaluations } | Unsettled::CertifyThenList { evaluations } = options.unsettled {
            if options.method == Method::Certified {
                return Err(GpuError::Options(
                    "the method is certified already: list what it leaves open, in place of a second certified search",
                ));
            }
            let second = Some(SearchParams { tolerance: options.tolerance, iterations: evaluations, ..first });
            let search = format!("search_{elements}_{kind}_certified");
            let is_listed = matches!(options.unsettled, Unsettled::CertifyThenList { .. });
            let taken = Frame {
                survivors: frame.unsettled,
                survivor_counter: counter::UNSETTLED,
                unsettled: if is_listed { frame.survivors } else { 0 },
                ..frame
            };
            steps.push(step(search, taken, second)?);
        }
        steps.push(step(format!("report_{elements}_{kind}"), frame, None)?);
        Ok(steps)
    }

    /// Clearing the counters, and the launches.
    pub(crate) fn stage_count(&self) -> usize {
        1 + self.steps.len() + 2 * usize::from(self.pose.is_some())
    }

    /// Starts one of the stages, which waits for those before it.
    pub(crate) fn launch(&mut self, stage: usize) -> Result<(), GpuError> {
        let stream = &self.gpu.stream;
        let Some(stage) = stage.checked_sub(1) else {
            return Ok(stream.memset_zeros(&mut self.mesh.counters)?);
        };
        // With a pose, the first and the last stage are its own.
        let (step, pose) = match self.pose {
            Some(pose) if stage == 0 => return self.place_points(&pose),
            Some(pose) => (self.steps.get(stage - 1), pose),
            None => (self.steps.get(stage), PoseParams::default()),
        };
        match step {
            Some(step) => {
                let mut launch = stream.launch_builder(&step.kernel);
                launch.arg(&self.field.blob).arg(&step.frame);
                if let Some(search) = &step.search {
                    launch.arg(search);
                }
                // SAFETY: the frame has the addresses of the mesh's own buffers, which have room for every element.
                unsafe { launch.launch(blocks(step.threads))? };
            }
            None => {
                let frame = self.frame();
                let mut launch = stream.launch_builder(&self.place_contacts);
                launch.arg(&pose).arg(&frame);
                // SAFETY: as above.
                unsafe { launch.launch(blocks(self.mesh.element_count))? };
            }
        }
        Ok(())
    }

    fn place_points(&mut self, pose: &PoseParams) -> Result<(), GpuError> {
        let (count, points) = (self.mesh.points.count() as u32, self.mesh.points.address(&self.gpu));
        let Some(local) = &mut self.mesh.local_points else { return Ok(()) };
        let mut launch = self.gpu.stream.launch_builder(&self.place_points);
        launch.arg(pose).arg(&points).arg(local).arg(&count);
        // SAFETY: both lists have that many points.
        unsafe { launch.launch(blocks(count))? };
        Ok(())
    }

    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}

/// A motion as the kernels take it.
fn params(pose: &Rigid) -> PoseParams {
    let local_from_world = pose.pull(Vector3::<f64>::zeros()).jacobian;
    PoseParams {
        local_from_world: [0, 1, 2].map(|row| [0, 1, 2].map(|column| local_from_world[(row, column)])),
        translation: pose.translation(),
    }
}

#[cfg(test)]
mod tests;
