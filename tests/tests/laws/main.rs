//! Laws that hold for every field, number type, method and element kind, checked over the tables of `sdf_tests`.
//!
//! One test binary: the methods are generic, and each further binary would compile all of them again.

/// Calls a generic law for vertices, edges and faces in f32 and f64.
macro_rules! for_every_simplex {
    ($law:ident) => {
        $law::<f32, 1>();
        $law::<f32, 2>();
        $law::<f32, 3>();
        $law::<f64, 1>();
        $law::<f64, 2>();
        $law::<f64, 3>();
    };
}

mod commands_in_docs;
mod contacts;
mod documents;
mod fields;
mod grids;
mod metamorphic;
mod minimizers;
mod numbers;
mod overlap;
mod stability;
