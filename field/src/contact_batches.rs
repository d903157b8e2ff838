//! Contacts of large meshes without a list of them: [`Field::visit_contacts`] searches a batch of elements at a time.

use std::ops::ControlFlow;

use sdf_core::contact::{Contact, ContactStatus, Feature, one_per_feature};

use crate::contacts::{self, CHUNK, Contacts};
use crate::mesh_view::check;
use crate::query_error::QueryError;
use crate::{ContactOptions, Elements, Field, MeshInMotion, MeshView};

/// Chunks of elements in a batch, for each thread: enough that no thread waits long for the last one.
const CHUNKS_PER_THREAD: usize = 8;

impl Field {
    /// [`contacts`](Self::contacts) one by one, in the same order, until `visit` breaks: for meshes with more contacts than should be
    /// in memory at once. No more than those of 4,096 elements for each thread are. Continues with the counts, and no contacts.
    ///
    /// With [`ContactOptions::one_per_feature`], those that stand for a feature are kept until the end; with
    /// [`ContactOptions::exact`], all are found first.
    pub fn visit_contacts(
        &self,
        mesh: MeshView,
        options: &ContactOptions,
        visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<(), Contacts>, QueryError> {
        if options.exact {
            return Ok(visit_all(self.contacts(mesh, options)?, visit));
        }
        let MeshView { points, faces } = mesh;
        match options.elements {
            Elements::Faces => self.visit_batches(points, faces, options, visit, |faces, options| {
                contacts::find(self.as_any(), MeshView { points, faces }, options)
            }),
            Elements::Edges => self.visit_contacts_of_edges(points, &mesh.edges(), options, visit),
            Elements::Vertices => self.visit_batches(points, &mesh.vertices(), options, visit, |vertices, options| {
                contacts::find_vertices(self.as_any(), points, vertices, options)
            }),
        }
    }

    /// [`visit_contacts`](Self::visit_contacts) of edges that are given, such as the line elements of a file.
    pub fn visit_contacts_of_edges(
        &self,
        points: &[[f64; 3]],
        edges: &[[u32; 2]],
        options: &ContactOptions,
        visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<(), Contacts>, QueryError> {
        if options.exact {
            return Ok(visit_all(self.contacts_of_edges(points, edges, options)?, visit));
        }
        self.visit_batches(points, edges, options, visit, |edges, options| {
            contacts::find_edges(self.as_any(), points, edges, options)
        })
    }

    /// [`contacts_in_motion`](Self::contacts_in_motion) one by one; all are found first.
    pub fn visit_contacts_in_motion(
        &self,
        mesh: &MeshInMotion,
        options: &ContactOptions,
        visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<(), Contacts>, QueryError> {
        Ok(visit_all(self.contacts_in_motion(mesh, options)?, visit))
    }

    fn visit_batches<const N: usize>(
        &self,
        points: &[[f64; 3]],
        elements: &[[u32; N]],
        options: &ContactOptions,
        mut visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>,
        find: impl Fn(&[[u32; N]], &ContactOptions) -> Result<Contacts, QueryError>,
    ) -> Result<ControlFlow<(), Contacts>, QueryError> {
        check(points, elements).map_err(QueryError::VertexOutOfRange)?;
        let batch = CHUNK * CHUNKS_PER_THREAD * options.threads.count();
        let mut all = Contacts { element_count: elements.len(), ..Contacts::default() };
        // No elements at all still have their options checked.
        let batches = elements.chunks(batch).chain(elements.is_empty().then_some(elements));
        for (first, batch) in (0..).step_by(batch).zip(batches) {
            let found = find(batch, options)?;
            all.searched_count += found.searched_count;
            all.undecided_count += found.undecided_count;
            all.not_finite_count += found.not_finite_count;
            for contact in found.contacts {
                let contact = counted_from(contact, first);
                if options.one_per_feature {
                    all.contacts.push(contact);
                    continue;
                }
                all.possible_count += usize::from(contact.status == ContactStatus::Possible);
                if visit(&contact).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        let count = one_per_feature(&mut all.contacts);
        all.contacts.truncate(count);
        all.possible_count += all.contacts.iter().filter(|contact| contact.status == ContactStatus::Possible).count();
        Ok(visit_all(all, visit))
    }
}

/// Visits contacts that are all found, and leaves their counts.
fn visit_all(mut found: Contacts, visit: impl FnMut(&Contact<f64>) -> ControlFlow<()>) -> ControlFlow<(), Contacts> {
    std::mem::take(&mut found.contacts).iter().try_for_each(visit).map_continue(|()| found)
}

/// The contact of an element, counted from the first of its batch, as one of the whole mesh.
fn counted_from(contact: Contact<f64>, first: u32) -> Contact<f64> {
    let element = contact.element + first;
    let feature = match contact.feature {
        Feature::Face(_) => Feature::Face(element),
        feature => feature,
    };
    Contact { element, feature, ..contact }
}
