//! Arrays of another program of the same card, which is cudarc by itself here: read where they are, waited for, and refused if they are
//! not what they should be.

use std::sync::Arc;

use cudarc::driver::result::memcpy_dtod_async;
use cudarc::driver::{CudaContext, CudaSlice, CudaStream, DevicePtr, DeviceRepr};
use sdf_core::contact::Contact;
use sdf_core::minimize::FrankWolfe;
use sdf_core::placed::Rigid;
use sdf_gpu::{
    CardContacts, Elements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, LentRows, QueryOptions, Ready, Unsettled,
};

use crate::scenes::{Scene, assert_equal, pulled, pushed, scene};
use crate::{gpu, with_stub};

/// A list that another program has on the card: its default stream copies it there, some time.
pub struct Other<T> {
    stream: Arc<CudaStream>,
    list: CudaSlice<T>,
}

impl<T: DeviceRepr> Other<T> {
    pub fn new(numbers: &[T]) -> Self {
        let stream = CudaContext::new(0).unwrap().default_stream();
        let list = stream.clone_htod(numbers).unwrap();
        Self { stream, list }
    }

    fn write(&mut self, numbers: &[T]) {
        self.stream.memcpy_htod(numbers, &mut self.list).unwrap();
    }

    fn address(&self) -> u64 {
        self.list.device_ptr(&self.stream).0
    }

    pub fn lend(&self, gpu: &Gpu, ready: Ready) -> LentRows {
        lend(gpu, self.address(), self.list.len() / 3, ready).unwrap()
    }
}

fn lend(gpu: &Gpu, address: u64, rows: usize, ready: Ready) -> Result<LentRows, GpuError> {
    // SAFETY: the tests keep their lists longer than their queries, and write between these.
    unsafe { gpu.lend(address, rows, ready) }
}

const DEFAULT_STREAM: Ready = Ready::AfterStream(1);

fn query(gpu: &Gpu, scene: &Scene, mesh: GpuMesh, unsettled: Unsettled) -> GpuQuery {
    let field = GpuField::new(gpu, &scene.field).unwrap();
    let options = QueryOptions { margin: scene.margin, unsettled, ..QueryOptions::default() };
    GpuQuery::new(gpu, &field, mesh, &options).unwrap()
}

fn expected(scene: &Scene, points: &[[f32; 3]], pose: Option<Rigid>) -> Vec<Contact<f32>> {
    let points = pose.map_or(points.to_vec(), |pose| pulled(points, &pose));
    let moved = Scene { points, field: scene.field.clone(), faces: scene.faces.clone(), edges: vec![], ..*scene };
    let (contacts, _) = moved.expected(&scene.faces, &FrankWolfe::default());
    contacts.iter().map(|contact| pose.map_or(*contact, |pose| pushed(contact, &pose))).collect()
}

#[test]
fn lent_arrays_are_read_where_they_are() {
    with_stub("lent::lent_arrays_are_read_where_they_are", &[], |folder| {
        let gpu = gpu(folder);
        for kind in ["dense", "sparse_u16", "shapes"] {
            let scene = scene(kind);
            let mut points = Other::new(scene.points.as_flattened());
            let mut faces = Other::new(scene.faces.as_flattened());
            let lent = Elements::LentFaces(faces.lend(&gpu, Ready::AfterAll));
            let mesh = GpuMesh::of_lent(&gpu, points.lend(&gpu, DEFAULT_STREAM), lent).unwrap();
            let mut query = query(&gpu, &scene, mesh, Unsettled::Keep);
            assert_equal(&query.contacts().unwrap().contacts, &expected(&scene, &scene.points, None), kind);
            assert_eq!(query.read_elements().unwrap(), scene.faces.as_flattened());

            // Faces were copied: what becomes of them does not matter.
            faces.write(&vec![u32::MAX; 3 * scene.faces.len()]);
            faces.lend(&gpu, Ready::AfterAll);
            // Points were not: the same memory with other numbers.
            let moved: Vec<[f32; 3]> = scene.points.iter().map(|point| point.map(|x| x + 0.03)).collect();
            points.write(moved.as_flattened());
            points.lend(&gpu, DEFAULT_STREAM);
            assert_equal(&query.contacts().unwrap().contacts, &expected(&scene, &moved, None), kind);
            let turned = Rigid::new([0.05, -0.1, 0.2], [0.1, 0.2, -0.3, 0.9]).unwrap();
            query.set_pose(Some(&turned)).unwrap();
            assert_equal(&query.contacts().unwrap().contacts, &expected(&scene, &moved, Some(turned)), kind);

            // Points of the host, and lent ones again.
            query.set_points(&scene.points).unwrap();
            assert_equal(&query.contacts().unwrap().contacts, &expected(&scene, &scene.points, Some(turned)), kind);
            query.set_pose(None).unwrap();
            query.lend_points(points.lend(&gpu, Ready::Now)).unwrap();
            assert_equal(&query.contacts().unwrap().contacts, &expected(&scene, &moved, None), kind);
            let bits = |points: &[[f32; 3]]| points.as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&query.read_points().unwrap()), bits(&moved));
        }
    });
}

#[test]
fn an_array_is_waited_for_as_it_asks() {
    with_stub("lent::an_array_is_waited_for_as_it_asks", &[], |folder| {
        let (gpu, numbers) = (gpu(folder), vec![0.5_f32; 6]);
        for (ready, is_there) in
            [(Ready::Now, false), (Ready::AfterStream(2), false), (DEFAULT_STREAM, true), (Ready::AfterAll, true)]
        {
            let points = Other::new(&numbers);
            let lent = points.lend(&gpu, ready);
            assert_eq!(gpu.read_lent::<[f32; 3]>(&lent).unwrap() == [[0.5; 3]; 2], is_there, "{ready:?}");
            points.lend(&gpu, Ready::AfterAll);
        }
    });
}

#[test]
fn what_is_not_an_array_on_the_card_is_refused() {
    with_stub("lent::what_is_not_an_array_on_the_card_is_refused", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let points = Other::new(scene.points.as_flattened());
        let (start, count) = (points.address(), scene.points.len());
        let host = scene.points.as_ptr() as u64;
        for (address, rows, words) in [
            (host, count, "not in the card's memory"),
            (0, count, "not in the card's memory"),
            (start, count + 1, "ends beyond its memory"),
            (start + 12, count, "ends beyond its memory"),
            (start + 12 * count as u64, 1, "not in the card's memory"),
            (start + 2, 1, "no number of four bytes"),
            (start, usize::MAX / 2, "more rows"),
        ] {
            let error = lend(&gpu, address, rows, Ready::Now).unwrap_err();
            assert!(matches!(error, GpuError::Lent(text) if text.contains(words)), "{rows} rows: {error}");
        }
        // Nothing has no address.
        let nothing = lend(&gpu, host, 0, Ready::Now).unwrap();
        let part = lend(&gpu, start + 12, count - 1, Ready::AfterAll).unwrap();
        let mesh = |points, faces| GpuMesh::of_lent(&gpu, points, faces);
        let faces = Other::new(&[0, 1, count as u32 - 1]);
        let lent = faces.lend(&gpu, Ready::AfterAll);
        for (points, faces) in [(part, Elements::LentFaces(lent)), (nothing, Elements::Faces(&[[0, 0, 0]]))] {
            let error = mesh(points, faces).unwrap_err();
            assert!(matches!(error, GpuError::NoVertex { element: 0, .. }), "{error}");
        }
        let mut empty = query(&gpu, &scene, mesh(nothing, Elements::LentFaces(nothing)).unwrap(), Unsettled::Keep);
        empty.set_pose(Some(&Rigid::new([1.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap())).unwrap();
        assert_eq!(empty.contacts().unwrap(), sdf_gpu::GpuContacts::default());
        assert!(matches!(empty.lend_points(part), Err(GpuError::PointCount { expected: 0, .. })));
    });
}

#[test]
fn contacts_that_stay_on_the_card_are_the_same() {
    with_stub("lent::contacts_that_stay_on_the_card_are_the_same", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let mesh = || GpuMesh::new(&gpu, &scene.points, Elements::Faces(&scene.faces)).unwrap();
        let mut asked = query(&gpu, &scene, mesh(), Unsettled::Keep);
        let expected = asked.contacts().unwrap().contacts;
        let found = asked.contacts_on_card().unwrap().unwrap();
        // Another frame, and the end of the query.
        asked.set_points(&vec![[9.0; 3]; scene.points.len()]).unwrap();
        assert!(asked.contacts_on_card().unwrap().unwrap().is_empty());
        drop(asked);
        let column = |name: &str| CardContacts::COLUMNS.iter().find(|column| column.name == name).unwrap();
        let numbers = |name: &str, row: usize| -> Vec<u32> {
            let start = found.address() + (row * CardContacts::STRIDE + column(name).offset) as u64;
            // SAFETY: memory of the stub is memory of this process; each column is of four bytes a number.
            (0..column(name).numbers as u64).map(|index| unsafe { *((start + 4 * index) as *const u32) }).collect()
        };
        assert_eq!(found.len(), expected.len());
        let mut rows: Vec<usize> = (0..found.len()).collect();
        rows.sort_by_key(|row| numbers("id", *row));
        for (row, contact) in rows.into_iter().zip(&expected) {
            assert_eq!(numbers("id", row), [contact.element]);
            assert_eq!(numbers("vertices", row), contact.vertices);
            assert_eq!(numbers("point", row), contact.point.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
            assert_eq!(numbers("lower_bound", row), [contact.lower_bound.to_bits()]);
            assert_eq!(CardContacts::STATUSES[numbers("status", row)[0] as usize], contact.status);
        }
        // An element that is listed for a search elsewhere is not among them.
        assert!(query(&gpu, &scene, mesh(), Unsettled::List).contacts_on_card().unwrap().is_none());
    });
}

#[test]
fn contacts_are_freed_after_who_reads_them() {
    with_stub("lent::contacts_are_freed_after_who_reads_them", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let mesh = GpuMesh::new(&gpu, &scene.points, Elements::Faces(&scene.faces)).unwrap();
        let found = query(&gpu, &scene, mesh, Unsettled::Keep).contacts_on_card().unwrap().unwrap();
        let bytes = found.len() * CardContacts::STRIDE;
        // SAFETY: memory of the stub is memory of this process.
        let expected = unsafe { std::slice::from_raw_parts(found.address() as *const u8, bytes) }.to_vec();
        // A stream of another program copies them, some time.
        let reader = Other::new(&vec![0_u8; bytes]);
        // SAFETY: both lists have that many bytes.
        unsafe { memcpy_dtod_async(reader.address(), found.address(), bytes, reader.stream.cu_stream()) }.unwrap();
        drop(found);
        reader.stream.synchronize().unwrap();
        assert!(reader.stream.clone_dtoh(&reader.list).unwrap() == expected && !expected.is_empty());
    });
}
