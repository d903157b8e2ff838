pub mod bake;
pub mod contacts;
pub mod demo;
pub mod eval;
pub mod info;
mod overlap;
pub mod slice;
pub mod surface;
pub mod verify;
