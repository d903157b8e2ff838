//! `contacts --reduce`: few contacts of a rigid body in place of many.

use anyhow::Result;
use sdf_core::contact::{Contact, Reduction};
use sdf_field::Contacts;
use sdf_formats::contact_file::ContactRows;
use serde::Serialize;

use crate::args::ContactsArgs;
use crate::failure::misuse;
use crate::report::number;

/// Summary of a reduction.
#[derive(Clone, Copy, Serialize)]
pub struct ReducedContacts {
    /// Contacts before it.
    pub found: usize,
    movement: f64,
    /// How far the others can sink.
    shortfall: f64,
}

impl ReducedContacts {
    pub fn in_words(&self, kept: usize) -> String {
        let (shortfall, movement) = (number(self.shortfall), number(self.movement));
        format!("to {kept}: where these are held, no other sinks by more than {shortfall} in a movement of {movement}")
    }
}

/// Keeps at most so many of the contacts, and appends them to the rows.
pub fn reduce(
    args: &ContactsArgs,
    count: usize,
    contacts: Vec<Contact<f64>>,
    rows: &mut ContactRows,
) -> Result<ReducedContacts> {
    let found = contacts.len();
    let depth = contacts.iter().map(|contact| -contact.distance).fold(0.0, f64::max);
    let movement = args.movement.unwrap_or(args.margin.max(0.0) + depth);
    if found == 0 {
        return Ok(ReducedContacts { found, movement, shortfall: 0.0 });
    }
    if movement <= 0.0 {
        misuse!("--reduce: no contact is deep and there is no --margin: say by --movement how far the body moves");
    }
    let mut contacts = Contacts { contacts, ..Contacts::default() };
    let reduced = contacts.reduce(&Reduction { count, movement, thickness: 0.0 })?;
    contacts.contacts.iter().for_each(|contact| rows.push(contact));
    Ok(ReducedContacts { found, movement, shortfall: reduced.shortfall })
}
