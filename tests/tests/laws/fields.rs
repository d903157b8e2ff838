//! Laws of every field in the table: promises 1, 2, 4, 5 and 6.

mod distances;
mod enclosures;
mod gradients;
mod not_finite;
mod plug_ins;
mod relaxations;
