//! Laws of the cull and of contact records: promises 1, 4, 6 and 7.

mod all_minima;
mod batch;
mod cull;
mod features;
mod margin;
mod normals;
mod records;
mod reduce;
mod resting;

use sdf_core::Float;
use sdf_core::contact::{Contact, Outcome};

fn expect_contact<R: Float, const N: usize>(outcome: Outcome<R, N>) -> Contact<R> {
    match outcome {
        Outcome::Contact(contact) => contact,
        other => panic!("expected a contact, found {other:?}"),
    }
}
