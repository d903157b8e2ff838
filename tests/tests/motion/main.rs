//! Laws of motion: fields that move or are deformed, and contacts from frame to frame.

mod affine;
mod moving;
