//! Contacts of large meshes without a list of them: [`Field::visit_contacts`] searches a batch of elements at a time.

use sdf_core::contact::{Contact, ContactStatus, Feature, one_per_feature};

use crate::contacts::{self, CHUNK, Contacts, QueryError};
use crate::mesh_view::check;
use crate::{ContactOptions, Elements, Field, MeshView};

/// Chunks of elements in a batch, for each thread: enough that no thread waits long for the last one.
const CHUNKS_PER_THREAD: usize = 8;

impl Field {
    /// [`contacts`](Self::contacts) one by one, in the same order, for meshes with more contacts than should be in memory at once:
    /// no more than those of 4,096 elements for each thread are. Returns the counts, and no contacts.
    ///
    /// With [`ContactOptions::one_per_feature`], those that stand for a feature are kept until the end.
    pub fn visit_contacts(
        &self,
        mesh: MeshView,
        options: &ContactOptions,
        visit: impl FnMut(&Contact<f64>),
    ) -> Result<Contacts, QueryError> {
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
        visit: impl FnMut(&Contact<f64>),
    ) -> Result<Contacts, QueryError> {
        self.visit_batches(points, edges, options, visit, |edges, options| {
            contacts::find_edges(self.as_any(), points, edges, options)
        })
    }

    fn visit_batches<const N: usize>(
        &self,
        points: &[[f64; 3]],
        elements: &[[u32; N]],
        options: &ContactOptions,
        mut visit: impl FnMut(&Contact<f64>),
        find: impl Fn(&[[u32; N]], &ContactOptions) -> Result<Contacts, QueryError>,
    ) -> Result<Contacts, QueryError> {
        check(points, elements).map_err(QueryError::VertexOutOfRange)?;
        let batch = CHUNK * CHUNKS_PER_THREAD * options.threads.count();
        let mut all = Contacts { element_count: elements.len(), ..Contacts::default() };
        let mut kept = vec![];
        // No elements at all still have their options checked.
        let batches = elements.chunks(batch).chain(elements.is_empty().then_some(elements));
        for (first, batch) in (0..).step_by(batch).zip(batches) {
            let found = find(batch, options)?;
            all.searched_count += found.searched_count;
            all.not_finite_count += found.not_finite_count;
            for contact in found.contacts {
                let contact = counted_from(contact, first);
                if options.one_per_feature {
                    kept.push(contact);
                } else {
                    all.possible_count += usize::from(contact.status == ContactStatus::Possible);
                    visit(&contact);
                }
            }
        }
        let count = one_per_feature(&mut kept);
        kept.truncate(count);
        all.possible_count += kept.iter().filter(|contact| contact.status == ContactStatus::Possible).count();
        kept.iter().for_each(visit);
        Ok(all)
    }
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
