//! A blob is the grid that it was written from, bit for bit, at any address; one that is damaged is refused, and one that is forged
//! does no harm.

use sdf_core::contact::{Element, Outcome, contact, lean_contact};
use sdf_core::grid::blob::{self, BlobError, checksum};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::grid::{Blob, Layout, Storage};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Float, Sdf, Simplex};
use sdf_formats::blob_file::{self, StoredBlob};

use crate::grid_samples::{KINDS, Made, about};
use crate::random::Random;

/// The grid of each kind, and its blob.
fn blobs(nodes: [u32; 3]) -> impl Iterator<Item = (OwnedGrid, Vec<u8>)> {
    KINDS.into_iter().map(move |kind| {
        let grid = Made::new(nodes, kind).grid();
        let bytes = blob_file::write(&grid, None, about().padding).unwrap();
        (grid, bytes)
    })
}

fn element<R: Float>(random: &mut Random) -> Element<R, 3> {
    let at = [0; 3].map(|_| random.between(-1.8, 1.8));
    let corner = |_| Vector3::from(at.map(|x| R::from_f64(x + random.between(-0.6, 0.6))));
    Element { id: 7, vertices: [1, 2, 3], simplex: Simplex { corners: [0, 1, 2].map(corner) } }
}

#[test]
fn a_blob_reads_back_as_the_grid_that_was_written() {
    for (grid, bytes) in blobs([19, 30, 25]) {
        let precision = grid.storage().precision();
        assert_eq!(blob_file::read(&bytes).unwrap(), StoredBlob { grid, precision, padding: about().padding });
    }
}

/// Samples, smooth gradients, bounds, errors and contacts by an exact and by a local search.
#[test]
fn a_blob_at_an_odd_address_has_the_bits_of_its_grid() {
    let mut random = Random::new(31);
    for (grid, bytes) in blobs([19, 30, 25]) {
        // Whatever address the vector has, one of the two is odd.
        for offset in [0, 1] {
            let mut moved = vec![0; offset];
            moved.extend(&bytes);
            let blob = Blob::open(&moved[offset..]).unwrap();
            // A dense grid of codes is a blob of bricks in all slots.
            let has_bricks = !grid.storage().scales().is_empty();
            assert_eq!(blob.layout() == Layout::Sparse, has_bricks);
            assert_eq!(blob.precision(), grid.storage().precision());
            same_bits::<f32>(&grid, &blob.grid(), &mut random);
            same_bits::<f64>(&grid, &blob.grid(), &mut random);
        }
        let blob = Blob::open(&bytes).unwrap();
        let typed = [
            blob.dense::<[u8; 4]>().is_some(),
            blob.sparse::<[u8; 4]>().is_some(),
            blob.sparse::<[u8; 2]>().is_some(),
            blob.sparse::<u8>().is_some(),
            blob.dense::<[u8; 2]>().is_some() || blob.dense::<u8>().is_some(),
        ];
        assert_eq!(typed.into_iter().filter(|is_some| *is_some).count(), 1);
    }
}

fn same_bits<R: Float>(grid: &OwnedGrid, blob: &impl EnclosedSdf, random: &mut Random) {
    assert_eq!((grid.slope_bound(), grid.bounds(0.1)), (blob.slope_bound(), blob.bounds(0.1)));
    let mut contacts = 0;
    for _ in 0..300 {
        let point: Vector3<R> = Vector3::from([0; 3].map(|_| R::from_f64(random.between(-2.3, 2.3))));
        assert_eq!(grid.sample(point), blob.sample(point));
        assert_eq!(grid.evaluate_smooth(point), blob.evaluate_smooth(point));
        let element = element::<R>(random);
        let region: Aabb = element.simplex.bounds();
        assert_eq!(grid.enclose_box(&region), blob.enclose_box(&region));
        assert_eq!(grid.error_bound(&region), blob.error_bound(&region));
        let margin = R::from_f64(0.05);
        let exact = contact(grid, &Certified::default(), margin, &element);
        assert_eq!(exact, contact(blob, &Certified::default(), margin, &element));
        assert_eq!(
            contact(grid, &FrankWolfe::default(), margin, &element),
            contact(blob, &FrankWolfe::default(), margin, &element)
        );
        lean_is_the_same(blob, &FrankWolfe::default(), margin, &element);
        contacts += usize::from(matches!(exact, Outcome::Contact(_)));
    }
    assert!(contacts > 30, "{contacts}");
}

/// The lean search finds each contact too, with the same bits but for bounds.
fn lean_is_the_same<R: Float>(
    field: &impl EnclosedSdf,
    minimizer: &impl Minimizer<3>,
    margin: R,
    element: &Element<R, 3>,
) {
    let full = contact(field, minimizer, margin, element);
    match (full, lean_contact(field, minimizer, margin, element)) {
        (Outcome::Contact(full), Outcome::Contact(lean)) => {
            assert!(lean.lower_bound <= full.lower_bound && lean.error_bound == R::from_f64(f64::INFINITY));
            let (lower_bound, error_bound) = (full.lower_bound, full.error_bound);
            let lean = sdf_core::contact::Contact { lower_bound, error_bound, ..lean };
            assert_eq!(sdf_core::contact::Contact { shape_lower_bound: full.shape_lower_bound, ..lean }, full);
        }
        // Without bounds in the box fewer are culled.
        (Outcome::Culled, Outcome::Separated(_)) => {}
        (full, lean) => assert_eq!(full, lean),
    }
}

#[test]
fn a_byte_of_a_blob_that_changed_never_goes_unnoticed() {
    let mut random = Random::new(32);
    for (_, bytes) in blobs([9, 10, 12]) {
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << random.below(8);
            let error = Blob::open(&damaged).unwrap_err();
            assert!(at < blob::NUMBERS_END || error == BlobError::Checksum, "byte {at}: {error}");
        }
        for length in 0..bytes.len() {
            assert!(Blob::open(&bytes[..length]).is_err(), "{length} bytes");
        }
        assert_eq!(Blob::open(&[&bytes[..], &[0]].concat()), Err(BlobError::Size));
        let error = blob_file::read(&bytes[..bytes.len() - 1]).unwrap_err();
        assert_eq!(error.to_string(), "the blob is cut off, or has bytes behind its end: copy it again");
    }
}

#[test]
fn the_checksum_is_that_of_zlib() {
    // The check value of CRC-32/ISO-HDLC, in Williams 1993, "A painless guide to CRC error detection algorithms".
    assert_eq!(checksum(b"123456789"), 0xcbf4_3926);
}

/// With a checksum that is right: what opens answers with numbers, and asks nothing beyond its arrays.
#[test]
fn a_forged_blob_does_no_harm() {
    let mut random = Random::from_clock();
    let (mut opened, mut refused) = (0, 0);
    for (_, bytes) in blobs([9, 10, 12]) {
        for _ in 0..1500 {
            let mut forged = bytes.clone();
            for _ in 0..=random.below(3) {
                // The head and tables more often than samples.
                let end = if random.below(2) == 0 { blob::NUMBERS_END + 64 } else { forged.len() };
                let at = random.below(end.min(forged.len()));
                forged[at] =
                    if random.below(2) == 0 { random.bits() as u8 } else { [0, 0x7f, 0x80, 0xff][random.below(4)] };
            }
            let crc = checksum(&forged).to_le_bytes();
            forged[blob::CHECKSUM_AT..blob::HEAD_BYTES].copy_from_slice(&crc);
            // The reader takes what opens, but for bricks that stand in two slots or in none.
            let read = blob_file::read(&forged).is_ok();
            let Ok(blob) = Blob::open(&forged) else {
                assert!(!read);
                refused += 1;
                continue;
            };
            opened += 1;
            let grid = blob.grid();
            let element = element::<f32>(&mut random);
            let point = element.simplex.corners[0];
            let sample = grid.sample(point);
            assert!(sample.value.is_finite() && sample.gradient.iter().all(|slope| slope.is_finite()), "{sample:?}");
            assert!(grid.storage().corners([0; 3]).iter().all(|corner| corner.is_finite()));
            let _ = contact(&grid, &Certified { evaluations: 16, ..Certified::default() }, 0.1, &element);
            if let Outcome::Contact(contact) = lean_contact(&grid, &FrankWolfe::default(), 0.1, &element) {
                assert!(contact.distance.is_finite() && contact.weights.iter().all(|weight| weight.is_finite()));
            }
        }
    }
    assert!(opened > 500 && refused > 500, "{opened} opened, {refused} refused");
}
