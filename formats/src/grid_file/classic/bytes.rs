use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::grid_file::Fault;

/// A file that is read by address, from any thread.
pub(super) struct Bytes {
    file: Mutex<File>,
    length: u64,
    taken: AtomicU64,
}

impl Bytes {
    pub(super) fn open(path: &Path) -> Result<Self, Fault> {
        // Before opening, for a pipe would wait for its writer.
        if !std::fs::metadata(path)?.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file").into());
        }
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file: Mutex::new(file), length, taken: AtomicU64::new(0) })
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// How many bytes have been read, some twice perhaps.
    pub(super) fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    pub(super) fn holds(&self, address: u64, count: u64) -> bool {
        address.checked_add(count).is_some_and(|end| end <= self.length)
    }

    /// Takes memory only for what the file holds.
    pub(super) fn at(&self, address: u64, count: usize) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::new();
        self.read_into(address, count, &mut bytes)?;
        Ok(bytes)
    }

    /// As [`Self::at`], in memory that is there from the last time.
    pub(super) fn read_into(&self, address: u64, count: usize, bytes: &mut Vec<u8>) -> Result<(), Fault> {
        if !self.holds(address, count as u64) {
            return Err(Fault::damaged(format!("{count} bytes at {address} lie outside its {} bytes", self.length)));
        }
        bytes.resize(count, 0);
        // A thread that panicked has left nothing but a position.
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(address))?;
        file.read_exact(bytes)?;
        self.taken.fetch_add(count as u64, Ordering::Relaxed);
        Ok(())
    }
}

/// What is left of a record: little-endian fields, one after the other.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(|| Fault::damaged("a record is cut short"))?;
        self.0 = rest;
        Ok(taken)
    }

    pub(super) fn skip(&mut self, count: usize) -> Result<(), Fault> {
        self.take(count).map(drop)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.take(N).map(|taken| taken.try_into().expect("N were taken"))
    }

    pub(super) fn u8(&mut self) -> Result<u8, Fault> {
        self.array().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Result<u16, Fault> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Fault> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, Fault> {
        self.array().map(u64::from_le_bytes)
    }

    /// The four letters that a block begins with.
    pub(super) fn expect(&mut self, signature: &[u8; 4]) -> Result<(), Fault> {
        if self.array::<4>()? == *signature {
            return Ok(());
        }
        Err(Fault::damaged(format!("no {} block where one should be", String::from_utf8_lossy(signature))))
    }
}
