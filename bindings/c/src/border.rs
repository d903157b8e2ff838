//! How do pointers become slices, and answers memory of the caller? The only `unsafe` code.
//!
//! A C function cannot say how long its pointers are valid or how much lies behind them: the header does, and every block below
//! relies on that alone. What can be checked is checked first: NULL, alignment, and that a length fits into memory.

#![expect(unsafe_code, reason = "memory of another language")]

use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use sdf_field::Threads;

use crate::types::{Failure, SdfError, SdfResult, thread_count};

/// Runs `work`; a failure and a panic become a result and a text.
pub fn guard(error: *mut SdfError, work: impl FnOnce() -> Result<(), Failure>) -> SdfResult {
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let (result, text) = match outcome {
        Ok(Ok(())) => (SdfResult::Ok, String::new()),
        Ok(Err(failure)) => (failure.result, failure.text),
        Err(_) => (SdfResult::Bug, "sdftool ran into a bug: please report it".to_owned()),
    };
    if !error.is_null() {
        // SAFETY: not NULL, so by the header an `SdfError`, whose bytes may have any value and need no alignment.
        unsafe { error.write(SdfError { text: ended_by_zero(&on_one_line(&text)) }) };
    }
    result
}

/// A file's name may hold line feeds, and what a terminal would act on.
fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// The text. What is too long is cut in its middle, where a path is, at whole characters: its end says why.
fn ended_by_zero(text: &str) -> [u8; 512] {
    const ROOM: usize = 511;
    const CUT: &str = "…";
    let short = (text.len() > ROOM).then(|| {
        let first = text.floor_char_boundary(ROOM / 4);
        let last = text.ceil_char_boundary(text.len() - (ROOM - first - CUT.len()));
        [&text[..first], CUT, &text[last..]].concat()
    });
    let text = short.as_deref().unwrap_or(text);
    let mut bytes = [0; ROOM + 1];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    bytes
}

/// `count` values that the caller lends. NULL will do for none.
pub fn slice<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer, count, what)?;
    // SAFETY: not NULL, aligned, of a length that fits into memory; by the header the values are there during the call.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// `count` rows of three values that the caller lends.
pub fn rows<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [[T; 3]], Failure> {
    slice(pointer.cast(), count, what)
}

/// A plain struct that the caller lends.
pub fn value<T: Copy>(pointer: *const T, what: &str) -> Result<T, Failure> {
    check(pointer, 1, what)?;
    // SAFETY: not NULL and aligned; by the header a value is there. Structs that come in hold numbers alone.
    Ok(unsafe { pointer.read() })
}

/// A handle that this library gave.
pub fn reference<'a, T>(handle: *const T, what: &str) -> Result<&'a T, Failure> {
    check(handle, 1, what)?;
    // SAFETY: not NULL; by the header it came from `Out::give` and is not freed during the call.
    Ok(unsafe { &*handle })
}

/// A handle that this library gave, and that no other call uses.
pub fn exclusive<'a, T>(handle: *mut T, what: &str) -> Result<&'a mut T, Failure> {
    check(handle, 1, what)?;
    // SAFETY: as of `reference`; by the header no other call uses it during this one.
    Ok(unsafe { &mut *handle })
}

/// A path or another text.
pub fn text<'a>(pointer: *const c_char, what: &str) -> Result<&'a str, Failure> {
    check(pointer, 1, what)?;
    // SAFETY: not NULL; by the header it is ended by a zero and stays during the call.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::invalid(format!("{what} is not UTF-8")))
}

/// Frees a handle. NULL is fine.
pub fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: by the header it came from `Out::give` and is not used again. No panic passes: dropping memory has none.
        drop(unsafe { Box::from_raw(handle) });
    }
}

fn check<T>(pointer: *const T, count: usize, what: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::invalid(format!("{what} is NULL")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::invalid(format!("{what} is not aligned")));
    }
    let is_possible = count.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    if is_possible { Ok(()) } else { Err(Failure::invalid(format!("{what}: {count} are more than memory holds"))) }
}

/// The place of the handle that a call makes: NULL until it succeeds.
pub struct Out<T>(*mut *mut T);

impl<T> Out<T> {
    pub fn new(out: *mut *mut T) -> Result<Self, Failure> {
        check(out, 1, "out")?;
        // SAFETY: not NULL and aligned; by the header a pointer may be written there.
        unsafe { out.write(std::ptr::null_mut()) };
        Ok(Self(out))
    }

    pub fn give(self, value: T) {
        let handle = Box::into_raw(Box::new(value));
        // SAFETY: as in `new`.
        unsafe { self.0.write(handle) };
    }
}

/// Memory of the caller that answers are written to, one after the other. It may be uninitialized: it is never read.
pub struct Writer<T> {
    next: *mut T,
    left: usize,
}

impl<T: Copy> Writer<T> {
    /// Room for `count` values.
    pub fn new(pointer: *mut T, count: usize, what: &str) -> Result<Self, Failure> {
        if count > 0 {
            check(pointer, count, what)?;
        }
        Ok(Self { next: pointer, left: count })
    }

    /// Writes the next value, if there is room.
    pub fn push(&mut self, value: T) {
        if self.left > 0 {
            // SAFETY: aligned, within the room that by the header is there, and no slice of Rust covers it.
            unsafe {
                self.next.write(value);
                self.next = self.next.add(1);
            }
            self.left -= 1;
        }
    }
}

/// One value that a call answers, of which something is known from the beginning.
pub struct Answer<T>(*mut T);

impl<T: Copy> Answer<T> {
    /// Writes what holds if the call fails.
    pub fn new(pointer: *mut T, at_first: T, what: &str) -> Result<Self, Failure> {
        check(pointer, 1, what)?;
        Self::optional(pointer, at_first, what)
    }

    /// The same; nothing is written where it is NULL.
    pub fn optional(pointer: *mut T, at_first: T, what: &str) -> Result<Self, Failure> {
        if !pointer.is_null() {
            check(pointer, 1, what)?;
        }
        let mut answer = Self(pointer);
        answer.set(at_first);
        Ok(answer)
    }

    pub fn set(&mut self, value: T) {
        if !self.0.is_null() {
            // SAFETY: not NULL and aligned; by the header a value may be written there, and no slice of Rust covers it.
            unsafe { self.0.write(value) };
        }
    }
}

/// Refuses room for fewer answers than there are.
pub fn require_room(found: usize, capacity: usize, what: &str) -> Result<(), Failure> {
    if found <= capacity {
        return Ok(());
    }
    Err(Failure::new(SdfResult::TooSmall, format!("room for {capacity} {what}, and {found} were found")))
}

/// A function of the caller and its argument.
pub struct Callback<F> {
    pub function: F,
    pub user: *mut c_void,
}

// SAFETY: the header says that any working thread may call it with this argument, one at a time.
unsafe impl<F: Send> Send for Callback<F> {}
// SAFETY: as above; calls are made under a lock.
unsafe impl<F: Sync> Sync for Callback<F> {}

/// Runs `work` on so many threads. One is the caller's. More are started and have ended when this returns.
pub fn on_threads<T: Send>(threads: u32, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
    let failure = |error: rayon::ThreadPoolBuildError| Failure::invalid(format!("threads {threads}: {error}"));
    let count = thread_count(threads)?;
    if count == 1 {
        return Threads::ONE.install(work);
    }
    // A scope waits for the threads of its pool.
    let builder = rayon::ThreadPoolBuilder::new().num_threads(count);
    builder.build_scoped(rayon::ThreadBuilder::run, |pool| pool.install(work)).map_err(failure)?
}
