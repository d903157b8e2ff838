//! sdftool for browsers: a WebAssembly module that `web/sdftool.js` loads, on the crate `sdf-field`.
//!
//! JavaScript writes arrays into buffers of the module ([`sdf_input`]) and a request as JSON, runs it ([`sdf_call`]), and reads the
//! answer from other buffers ([`sdf_output`]). So nobody frees anything, no pointer comes in, and there is no `unsafe` block.
//!
//! | question | file |
//! |---|---|
//! | How do arrays cross the border? What becomes of a panic? | here |
//! | Which requests are there, and what are their answers? | `request` |
//! | Which words stand for which option? | `options` |

mod options;
mod request;

use std::cell::RefCell;

use sdf_field::Field;
use serde::Serialize;

/// Arrays on their way in or out.
#[derive(Default)]
struct Buffers {
    f64s: Vec<f64>,
    u32s: Vec<u32>,
    bytes: Vec<u8>,
    /// JSON; the text of an error.
    text: Vec<u8>,
}

/// Number of a buffer: as `sdftool.js` has them.
const F64S: u32 = 0;
const U32S: u32 = 1;
const BYTES: u32 = 2;

thread_local! {
    static INPUT: RefCell<Buffers> = RefCell::default();
    static OUTPUT: RefCell<Buffers> = RefCell::default();
    /// Fields by their number.
    static FIELDS: RefCell<Vec<Option<Field>>> = RefCell::default();
}

#[cfg_attr(target_arch = "wasm32", link(wasm_import_module = "sdftool"))]
unsafe extern "C" {
    /// Tells how many of all steps are done; anything but 0 ends the bake.
    safe fn progress(done: f64, total: f64) -> i32;
    /// Receives the text of a panic, after which the module is dead.
    safe fn panicked(text: *const u8, length: usize);
}

/// Makes room for so many elements of an input and returns where they are to be written; null where there is no memory for them.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_input(buffer: u32, count: usize) -> *mut u8 {
    fn resized<T: Default + Clone>(buffer: &mut Vec<T>, count: usize) -> *mut u8 {
        *buffer = Vec::new();
        if buffer.try_reserve_exact(count).is_err() {
            return std::ptr::null_mut();
        }
        buffer.resize(count, T::default());
        buffer.as_mut_ptr().cast()
    }
    INPUT.with_borrow_mut(|input| match buffer {
        F64S => resized(&mut input.f64s, count),
        U32S => resized(&mut input.u32s, count),
        BYTES => resized(&mut input.bytes, count),
        _ => resized(&mut input.text, count),
    })
}

/// Runs the request in the input's text, with the arrays that it needs. 1: the output has the answer. 0: its text says why not.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_call() -> i32 {
    std::panic::set_hook(Box::new(|panic| {
        let text = panic.to_string();
        panicked(text.as_ptr(), text.len());
    }));
    // Taken out, so that their memory is free afterwards.
    let input = INPUT.take();
    OUTPUT.take();
    let (is_done, output) = match request::run(input) {
        Ok(output) => (1, output),
        Err(text) => (0, Buffers { text: text.into_bytes(), ..Buffers::default() }),
    };
    OUTPUT.set(output);
    is_done
}

/// Where an output lies.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_output(buffer: u32) -> *const u8 {
    OUTPUT.with_borrow(|output| match buffer {
        F64S => output.f64s.as_ptr().cast(),
        U32S => output.u32s.as_ptr().cast(),
        BYTES => output.bytes.as_ptr(),
        _ => output.text.as_ptr(),
    })
}

/// How many elements it has.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_output_count(buffer: u32) -> usize {
    OUTPUT.with_borrow(|output| match buffer {
        F64S => output.f64s.len(),
        U32S => output.u32s.len(),
        BYTES => output.bytes.len(),
        _ => output.text.len(),
    })
}

impl Buffers {
    /// An answer without arrays.
    fn text(answer: &impl Serialize) -> Result<Self, String> {
        let text = serde_json::to_vec(answer).map_err(|error| error.to_string())?;
        Ok(Self { text, ..Self::default() })
    }
}
