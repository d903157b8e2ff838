//! Few contacts of a rigid body in place of many.

use sdf_core::contact::{Contact, MAX_REDUCED, Reduced, Reduction};

use crate::{Contacts, QueryError};

impl Contacts {
    /// Keeps the few contacts that hold a rigid body as all of them do, in the order of elements, and says how far the others can sink
    /// nevertheless: see [`Reduction`]. The counts stay those of the search.
    ///
    /// ```
    /// use sdf_field::{ContactOptions, Field, MeshView, core::{contact::Reduction, shapes::HalfSpace}};
    /// // A plate of 200 faces rests on the ground.
    /// let points: Vec<[f64; 3]> = (0..121).map(|id| [f64::from(id % 11), f64::from(id / 11), 0.0]).collect();
    /// let corners = (0..100).map(|id| id % 10 + id / 10 * 11);
    /// let faces: Vec<[u32; 3]> = corners.flat_map(|a| [[a, a + 1, a + 12], [a + 12, a + 11, a]]).collect();
    /// let ground = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    /// let mut found = ground.contacts(MeshView { points: &points, faces: &faces }, &ContactOptions::default())?;
    /// assert_eq!(found.contacts.len(), 200);
    /// let reduced = found.reduce(&Reduction { count: 16, movement: 0.01, thickness: 0.0 })?;
    /// assert!(reduced.count <= 16 && found.contacts.len() == reduced.count && reduced.shortfall < 0.002);
    /// # Ok::<(), sdf_field::QueryError>(())
    /// ```
    pub fn reduce(&mut self, reduction: &Reduction<f64>) -> Result<Reduced<f64>, QueryError> {
        if !(1..=MAX_REDUCED).contains(&reduction.count) {
            return Err(QueryError::CountOutOfRange(reduction.count));
        }
        if !reduction.thickness.is_finite() {
            return Err(QueryError::ThicknessOutOfRange);
        }
        let is_finite = |contact: &Contact<f64>| {
            let Contact { point, normal, distance, .. } = contact;
            point.iter().chain(normal.iter()).chain([distance]).all(|x| x.is_finite())
        };
        if let Some(wrong) = self.contacts.iter().position(|contact| !is_finite(contact)) {
            return Err(QueryError::ContactNotFinite(wrong));
        }
        let mut scratch = vec![0.0; self.contacts.len()];
        let reduced = reduction.apply(&mut self.contacts, &mut scratch).ok_or(QueryError::MovementOutOfRange)?;
        self.contacts.truncate(reduced.count);
        Ok(reduced)
    }
}
