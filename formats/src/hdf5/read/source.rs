//! Bytes of a file by address. Reads outside of the file are errors, and take no memory.
//!
//! Positioned reads, not a mapping: that needs `unsafe`, and another process that cuts the file short would end this one.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use super::ReadError;

/// The bytes of a file, on disk or in memory, by address and from any thread.
pub(super) struct ByteSource<'a> {
    data: Data<'a>,
    length: u64,
    bytes_read: AtomicU64,
}

enum Data<'a> {
    File(DiskFile),
    Memory(Cow<'a, [u8]>),
}

impl<'a> ByteSource<'a> {
    pub(super) fn open(path: &Path) -> Result<Self, ReadError> {
        // Checked before opening, because opening a pipe waits for its writer.
        if !std::fs::metadata(path)?.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file").into());
        }
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { data: Data::File(DiskFile::new(file)), length, bytes_read: AtomicU64::new(0) })
    }

    pub(super) fn new(bytes: Cow<'a, [u8]>) -> Self {
        Self { length: bytes.len() as u64, data: Data::Memory(bytes), bytes_read: AtomicU64::new(0) }
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Bytes read so far; bytes read twice count twice.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    pub(super) fn contains(&self, address: u64, count: u64) -> bool {
        address.checked_add(count).is_some_and(|end| end <= self.length)
    }

    /// The bytes at an address. Takes memory only for what the source holds.
    pub(super) fn read(&self, address: u64, count: usize) -> Result<Vec<u8>, ReadError> {
        let mut bytes = Vec::new();
        self.read_into(address, count, &mut bytes)?;
        Ok(bytes)
    }

    /// Like [`Self::read`], but reuses a buffer.
    pub(super) fn read_into(&self, address: u64, count: usize, buffer: &mut Vec<u8>) -> Result<(), ReadError> {
        if !self.contains(address, count as u64) {
            return Err(ReadError::damaged(format!(
                "{count} bytes at {address} lie outside its {} bytes",
                self.length
            )));
        }
        match &self.data {
            Data::File(file) => {
                buffer.resize(count, 0);
                file.read_exact_at(buffer, address)?;
            }
            Data::Memory(bytes) => {
                buffer.clear();
                buffer.extend_from_slice(&bytes[address as usize..][..count]);
            }
        }
        self.bytes_read.fetch_add(count as u64, Ordering::Relaxed);
        Ok(())
    }
}

/// A file that several threads read, each at its own place.
#[cfg(unix)]
struct DiskFile(File);

#[cfg(unix)]
impl DiskFile {
    fn new(file: File) -> Self {
        Self(file)
    }

    fn read_exact_at(&self, buffer: &mut [u8], address: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.0, buffer, address)
    }
}

/// A file that several threads read, one after the other: its position is one for all.
#[cfg(not(unix))]
struct DiskFile(std::sync::Mutex<File>);

#[cfg(not(unix))]
impl DiskFile {
    fn new(file: File) -> Self {
        Self(std::sync::Mutex::new(file))
    }

    fn read_exact_at(&self, buffer: &mut [u8], address: u64) -> io::Result<()> {
        use std::io::{Read, Seek, SeekFrom};
        // A thread that panicked leaves only a file position behind.
        let mut file = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.seek(SeekFrom::Start(address))?;
        file.read_exact(buffer)
    }
}
