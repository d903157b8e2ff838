//! Contacts one after the other, in memory that does not grow with the mesh: [`Field::visit_contacts`].

use std::ops::ControlFlow;

use sdf_core::contact::{Contact, Feature};

use crate::contacts::QueryError;
use crate::options::Elements;
use crate::{ContactOptions, Field, MeshView};

/// Faces that are searched before their contacts are handed on: enough for all threads.
const BLOCK: usize = 1 << 15;

impl Field {
    /// Calls `visit` with each contact that [`contacts`](Self::contacts) would return, in the same order, until it breaks.
    ///
    /// Faces are searched in blocks, so that few contacts are in memory at a time. Edges and vertices are searched at once, and so
    /// are faces where one contact for each feature is asked for.
    pub fn visit_contacts(
        &self,
        mesh: MeshView,
        options: &ContactOptions,
        mut visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, QueryError> {
        if options.elements != Elements::Faces || options.one_per_feature {
            return Ok(self.contacts(mesh, options)?.contacts.iter().try_for_each(visit));
        }
        crate::mesh_view::check(mesh.points, mesh.faces).map_err(QueryError::VertexOutOfRange)?;
        for (block, faces) in mesh.faces.chunks(BLOCK).enumerate() {
            let first = (block * BLOCK) as u32;
            let found = self.contacts(MeshView { faces, ..mesh }, options)?;
            let flow = found.contacts.into_iter().try_for_each(|contact| visit(&renumbered(contact, first)));
            if flow.is_break() {
                return Ok(flow);
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// The contact of a face that is the `first`th of a block.
fn renumbered(contact: Contact<f64>, first: u32) -> Contact<f64> {
    let feature = match contact.feature {
        Feature::Face(face) => Feature::Face(face + first),
        other => other,
    };
    Contact { element: contact.element + first, feature, ..contact }
}
