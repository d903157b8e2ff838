//! A damaged file is refused, at once and with little memory, or reads as it was written.

use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sdf_core::Aabb;
use sdf_core::grid::Storage;
use sdf_core::grid::owned::{OwnedGrid, Precision};
use sdf_formats::grid_file::{self, GridFault};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, KINDS, Kind, Made, SPARSE_U16, about};
use crate::memory::{peak_of, run_on_one_thread};
use crate::random::Random;

const DENSE_U16: Kind = Kind::Dense(Precision::U16);

/// Limit for a reading thread: samples, tables and chunks of these files take less than four times the file's size.
fn max_memory(file_bytes: usize) -> usize {
    (1 << 20) + 5 * file_bytes
}

/// A file on disk, and its undamaged content.
struct Sample {
    _folder: TempDir,
    path: PathBuf,
    bytes: Vec<u8>,
    grid: OwnedGrid,
}

impl Sample {
    fn new(nodes: [u32; 3]) -> Self {
        Self::written(&Made::new(nodes, DENSE))
    }

    fn written(made: &Made) -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("grid.sdf.h5");
        made.write(&path);
        let bytes = fs::read(&path).unwrap();
        Self { _folder: folder, path, bytes, grid: made.grid() }
    }

    /// Writes bytes that were appended, and says so in the superblock.
    fn write_longer(&mut self) {
        let end = self.bytes.len() as u64;
        self.bytes[40..48].copy_from_slice(&end.to_le_bytes());
        fs::write(&self.path, &self.bytes).unwrap();
    }

    /// The fault of the file with these bytes in place of its own, or `None` after checking that the same grid is read.
    fn read_with(&self, at: usize, bytes: &[u8]) -> Option<GridFault> {
        overwrite(&self.path, at, bytes);
        let (answer, memory) = peak_of(|| run_on_one_thread(|| grid_file::read(&self.path)));
        assert!(memory < max_memory(self.bytes.len()), "{memory} bytes with {bytes:?} at {at}");
        // Reading a part notices damage exactly in what it reads.
        let lattice = self.grid.lattice();
        let corner = Aabb { min: lattice.origin(), max: lattice.origin() };
        let part = grid_file::open(&self.path).and_then(|reader| reader.read_needed([corner], f64::MAX));
        overwrite(&self.path, at, &self.bytes[at..at + bytes.len()]);
        if let Ok(part) = part {
            assert_eq!((part.grid.lattice(), &part.about), (lattice, &about()), "at {at}: {bytes:?}");
            let corners = |grid: &OwnedGrid| grid.storage().corners([0; 3]).map(f32::to_bits);
            assert_eq!(corners(&part.grid), corners(&self.grid), "another part with {bytes:?} at {at}");
            let bounds = |grid: &OwnedGrid| grid.storage().block_bounds([0; 3], [1; 3]);
            assert_eq!(bounds(&part.grid), bounds(&self.grid), "other bounds with {bytes:?} at {at}");
        } else {
            assert!(answer.is_err());
        }
        match answer {
            Ok(stored) => {
                assert!(stored.grid == self.grid && stored.about == about(), "another grid with {bytes:?} at {at}");
            }
            Err(error) => {
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
                return Some(error.fault);
            }
        }
        None
    }

    /// Offset of the only occurrence of these bytes.
    fn find(&self, wanted: &[u8]) -> usize {
        let mut found = (0..self.bytes.len()).filter(|at| self.bytes[*at..].starts_with(wanted));
        let at = found.next().expect("occurs");
        assert_eq!(found.next(), None, "occurs twice");
        at
    }

    /// Offset of the chunk tree: the only tree of type 1.
    fn chunk_tree(&self) -> usize {
        (0..self.bytes.len()).find(|at| self.bytes[*at..].starts_with(b"TREE\x01")).unwrap()
    }
}

fn overwrite(path: &Path, at: usize, bytes: &[u8]) {
    let mut file = OpenOptions::new().write(true).open(path).unwrap();
    file.seek(SeekFrom::Start(at as u64)).unwrap();
    file.write_all(bytes).unwrap();
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    for (nodes, kind) in
        [([2, 3, 5], DENSE), ([40, 33, 2], DENSE), ([9, 9, 30], Kind::Sparse(Precision::U8)), ([9, 9, 3], DENSE_U16)]
    {
        let sample = Sample::written(&Made::new(nodes, kind));
        let file = OpenOptions::new().write(true).open(&sample.path).unwrap();
        for length in (0..sample.bytes.len()).rev() {
            file.set_len(length as u64).unwrap();
            let error = grid_file::read(&sample.path).expect_err("cut short").to_string();
            assert!(error.lines().count() == 1 && error.contains("; "), "{error}");
            assert!(grid_file::open(&sample.path).is_err());
        }
    }
}

/// Every second byte, from the first or the second on: in two runs all.
#[test]
fn a_byte_that_changed_never_goes_unnoticed() {
    let mut random = Random::from_clock();
    for (nodes, kind) in [([2, 3, 5], DENSE), ([9, 9, 9], SPARSE_U16), ([9, 9, 3], DENSE_U16)] {
        let sample = Sample::written(&Made::new(nodes, kind));
        let mut noticed = 0;
        for at in (random.below(2)..sample.bytes.len()).step_by(2) {
            let change = [1 << random.below(8), 0xff, 1 + random.below(255) as u8][random.below(3)];
            noticed += usize::from(sample.read_with(at, &[sample.bytes[at] ^ change]).is_some());
        }
        // The rest is space that HDF5 reserves and nobody reads.
        println!("{noticed} of {}", sample.bytes.len());
        assert!(noticed > 500, "{noticed}");
    }
}

/// Every bit of the superblock counts but those of the ranks of trees, which this reader does not need, and what is kept of the root beside
/// its header. HDF5 itself opens no file with one of the others changed.
#[test]
fn a_bit_that_changed_in_the_superblock_is_noticed() {
    for kind in [DENSE, SPARSE_U16] {
        let sample = Sample::written(&Made::new([9, 9, 9], kind));
        for (at, bit) in (0..72).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let change = sample.bytes[at] ^ 1 << bit;
            let is_needed = !(16..20).contains(&at) && !(56..64).contains(&at);
            assert!(!is_needed || sample.read_with(at, &[change]).is_some(), "bit {bit} of byte {at}");
        }
    }
}

#[test]
fn bytes_after_the_end_are_noticed() {
    let sample = Sample::new([2, 3, 5]);
    fs::write(&sample.path, [&sample.bytes[..], &[0]].concat()).unwrap();
    assert!(grid_file::read(&sample.path).unwrap_err().to_string().contains("its header says"));
}

#[test]
fn many_bytes_that_changed_never_go_unnoticed() {
    let mut random = Random::from_clock();
    // Eight chunks; 70 chunks, which need a tree of two levels; about 90 bricks.
    let sparse = KINDS.map(|kind| ([44, 44, 44], kind));
    for (nodes, kind) in [([33, 33, 33], DENSE), ([2, 2, 2240], DENSE)].into_iter().chain(sparse) {
        let sample = Sample::written(&Made::new(nodes, kind));
        for _ in 0..600 {
            let length = [1, 2, 4, 8, 100][random.below(5)];
            let at = random.below(sample.bytes.len() - length);
            let flood = [0, 0xff, random.below(256) as u8][random.below(3)];
            let noise = (0..length).map(|_| random.below(256) as u8).collect();
            sample.read_with(at, &[vec![flood; length], noise][random.below(2)]);
        }
    }
}

/// Changes where they matter most: near the marks of HDF5 structures.
#[test]
fn changed_structure_never_goes_unnoticed() {
    for kind in [DENSE, DENSE_U16, SPARSE_U16] {
        change_structure(&Sample::written(&Made::new([33, 33, 33], kind)));
    }
}

fn change_structure(sample: &Sample) {
    let mut random = Random::from_clock();
    let marks = [&b"TREE"[..], b"SNOD", b"HEAP", b"GCOL", b"WholeExtent", b"format_version"];
    let offsets: Vec<usize> = (0..sample.bytes.len() - 16)
        .filter(|at| marks.iter().any(|mark| sample.bytes[*at..].starts_with(mark)))
        .chain([0])
        .collect();
    for _ in 0..2_500 {
        let at = offsets[random.below(offsets.len())] + random.below(200);
        let value = [0, 1, 255, 24, 96, 65536, sample.bytes.len() - 1, usize::MAX, random.below(usize::MAX)];
        let width = [1, 2, 4, 8][random.below(4)].min(sample.bytes.len() - at.min(sample.bytes.len() - 1));
        if at + width <= sample.bytes.len() {
            sample.read_with(at, &value[random.below(value.len())].to_le_bytes()[..width]);
        }
    }
}

#[test]
fn a_shape_too_large_for_the_file_is_refused_before_memory_is_taken() {
    let sample = Sample::new([2, 3, 5]);
    let shape: Vec<u8> = [5_u64, 3, 2].iter().flat_map(|n| n.to_le_bytes()).collect();
    // It occurs twice, as shape and as maximal shape; the reader uses the first.
    let at = (0..sample.bytes.len()).find(|at| sample.bytes[*at..].starts_with(&shape)).unwrap();
    let chunk = sample.find(&[5, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0]);
    for huge in [[8192; 3], [1 << 24; 3], [u64::MAX; 3], [1 << 63, 2, 2], [0, 3, 2]] {
        let huge_shape: Vec<u8> = huge.iter().flat_map(|n| n.to_le_bytes()).collect();
        let fault = sample.read_with(at, &huge_shape).expect("too many chunks");
        assert!(fault.to_string().contains("declared"), "{fault}");
        // With as large a chunk.
        overwrite(&sample.path, at, &huge_shape);
        let huge_chunk: Vec<u8> = huge.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect();
        let fault = sample.read_with(chunk, &huge_chunk).expect("too large a chunk");
        assert!(fault.to_string().contains("declared"), "{fault}");
        overwrite(&sample.path, at, &shape);
    }
    assert!(sample.read_with(0, &[]).is_none());
}

#[test]
fn a_chunk_that_inflates_without_end_is_stopped() {
    use flate2::{Compression, write::ZlibEncoder};
    let mut sample = Sample::new([40, 40, 40]);
    let mut bomb = ZlibEncoder::new(Vec::new(), Compression::best());
    bomb.write_all(&vec![0; 16 << 20]).unwrap();
    let bomb = bomb.finish().unwrap();
    // The bomb at the end of the file replaces the first chunk; the tree's first key gets its size and address.
    let tree = sample.chunk_tree();
    let end = sample.bytes.len();
    sample.bytes.extend(&bomb);
    sample.bytes[tree + 24..][..4].copy_from_slice(&(bomb.len() as u32).to_le_bytes());
    sample.bytes[tree + 64..][..8].copy_from_slice(&(end as u64).to_le_bytes());
    sample.write_longer();
    let fault = sample.read_with(0, &[]).unwrap();
    assert!(fault.to_string().contains("does not inflate to its size"), "{fault}");
}

#[test]
fn a_tree_that_bites_its_tail_is_refused() {
    let sample = Sample::new([33, 33, 33]);
    let tree = sample.chunk_tree();
    let count = sample.bytes[tree + 6] as usize;
    for level in [1, 2, 5, 6, 255] {
        let mut node = sample.bytes[tree..tree + 24 + 48 * count].to_vec();
        node[5] = level;
        for entry in 0..count {
            node[24 + entry * 48 + 40..][..8].copy_from_slice(&(tree as u64).to_le_bytes());
        }
        assert!(sample.read_with(tree, &node).is_some());
    }
}

/// Each chunk inflates to its size.
#[test]
fn swapped_chunks_are_noticed() {
    let sample = Sample::new([40, 40, 40]);
    let entries = sample.chunk_tree() + 24;
    // Stored sizes, and addresses 40 bytes further on.
    let [first, second] = [0, 48].map(|at| sample.bytes[entries + at..][..48].to_vec());
    let mut swapped = [first.clone(), second.clone()].concat();
    for (at, length) in [(0, 4), (40, 8)] {
        swapped[at..at + length].copy_from_slice(&second[at..at + length]);
        swapped[48 + at..48 + at + length].copy_from_slice(&first[at..at + length]);
    }
    let fault = sample.read_with(entries, &swapped).unwrap();
    assert!(fault.to_string().starts_with("checksum of a chunk of distance does not match"), "{fault}");
}

/// 22 KB that stand for 64⁶ chunks.
#[test]
fn a_tree_of_shared_nodes_is_refused_at_once() {
    let mut sample = Sample::new([33, 33, 33]);
    let tree = sample.chunk_tree();
    let entry = sample.bytes[tree + 24..][..48].to_vec();
    let head = [&sample.bytes[tree..][..5], &[0, 64, 0], &sample.bytes[tree + 8..][..16]].concat();
    for level in 0..=5 {
        // A last key follows the last child.
        let mut node = [head.clone(), entry.repeat(64), vec![0; 40]].concat();
        node[5] = level;
        let below = sample.bytes.len() - node.len();
        for child in node[24..].chunks_exact_mut(48).filter(|_| level > 0) {
            child[40..].copy_from_slice(&(below as u64).to_le_bytes());
        }
        match level {
            5 => sample.bytes[tree..][..node.len()].copy_from_slice(&node),
            _ => sample.bytes.extend(node),
        }
    }
    sample.write_longer();
    let fault = sample.read_with(0, &[]).unwrap();
    assert!(fault.to_string().starts_with("a chunk of distance is there twice"), "{fault}");
    if let Some(path) = std::env::var_os("KEEP") {
        fs::copy(&sample.path, path).unwrap();
    }
}

#[test]
fn another_version_is_refused_by_its_number() {
    let sample = Sample::new([2, 3, 5]);
    // After the name (15 bytes and a NUL), the type and the space.
    let at = sample.find(b"format_version\0") + 16 + 16 + 8;
    assert_eq!(sample.bytes[at], 4);
    let fault = sample.read_with(at, &[6]).unwrap();
    assert_eq!(fault.to_string(), "format version 6, and this program reads up to 5; update sdftool");
    // That of dense grids of codes alone.
    let fault = sample.read_with(at, &[5]).unwrap();
    assert!(fault.to_string().contains("precision"), "{fault}");
    let fault = sample.read_with(at, &[1]).unwrap();
    assert_eq!(fault.to_string(), "format version 1, and this program reads versions from 2 on; bake it again");
}

#[test]
fn refusals_say_what_the_file_is() {
    let sample = Sample::new([33, 33, 33]);
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("dragon.sdf.h5");
    let message = || {
        let error = grid_file::read(&path).unwrap_err().to_string();
        error.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
    };

    assert!(message().contains("No such file"));
    File::create(&path).unwrap();
    assert!(message().starts_with("not an HDF5 file; "));
    fs::write(&path, b"# OBJ\nv 0 0 0\n").unwrap();
    assert!(message().starts_with("not an HDF5 file; "));
    rust_hdf5::H5File::options().libver(rust_hdf5::LibverBound::Earliest).create(&path).unwrap().close().unwrap();
    assert!(message().starts_with("an HDF5 file, but not an sdftool grid: it has no sdf; "));
    rust_hdf5::H5File::create(&path).unwrap().close().unwrap();
    assert!(message().starts_with("an HDF5 file, but not an sdftool grid: its superblock"));

    fs::write(&path, &sample.bytes).unwrap();
    // In the middle of the first chunk, near the beginning of the file.
    overwrite(&path, 5000, &[!sample.bytes[5000]]);
    assert!(message().ends_with(": the file is damaged; bake it again"));

    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    assert_eq!(message(), "not a regular file");
}

/// Both checksums hold, but the groups contradict each other, as a foreign program could write them.
#[test]
fn groups_that_do_not_agree_are_refused() {
    let sample = Sample::new([2, 3, 5]);
    // The padded name, the padded type and a dataspace of 24 bytes precede the value.
    for (name, head) in [("Origin", 8 + 24), ("Spacing", 8 + 24), ("WholeExtent", 16 + 16), ("Direction", 16 + 24)] {
        let at = sample.find(name.as_bytes()) + head + 24;
        let before = sample.bytes[at + 6];
        let fault = sample.read_with(at + 6, &[before ^ 0x11]).unwrap();
        assert!(fault.to_string().starts_with("/VTKHDF and /sdf do not agree"), "{name}: {fault}");
    }
}
