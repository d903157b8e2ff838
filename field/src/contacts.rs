//! Contacts of a mesh with a field: elements in chunks, each chunk by the [`engine`](crate::engine), chunks on all threads.

use sdf_core::contact::{Contact, ContactStatus, Element, Outcome, all_contacts, contact_at, one_per_feature};
use sdf_core::minimize::{
    AllMinima, Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, Newton, PointSampling, ProjectedGradient,
    SimplexCell,
};
use sdf_core::placed::Posed;
use sdf_core::{AnyField, EnclosedSdf, ErrorBound};

use crate::engine::{CullMargins, Query};
use crate::mesh_in_motion::{MeshInMotion, Selection};
use crate::mesh_view::MeshView;
use crate::method::Method;
use crate::options::{ContactOptions, Elements};
use crate::query_error::QueryError;

/// The contacts of a mesh, in the order of its elements, and what became of the other elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// In the order of the elements; the minima of one element from the lowest on.
    pub contacts: Vec<Contact<f64>>,
    /// All elements.
    pub element_count: usize,
    /// Elements that were searched: not culled, and finite. 0 of lean contacts of a card, which does not count them.
    pub searched_count: usize,
    /// Contacts with the status [`Possible`](sdf_core::contact::ContactStatus::Possible): see
    /// [`ContactOptions::complete`].
    pub possible_count: usize,
    /// Elements without a contact of which `auto` and `certified` could not prove that there is none: the budget was spent before, or the lowest
    /// value is above the margin by less than the tolerance or rounding. A larger budget decides most of them, a smaller tolerance those
    /// nearest to the margin, and a [`complete`](ContactOptions::complete) search lists them. 0 of other methods, which prove nothing.
    pub undecided_count: usize,
    /// Elements that were skipped: a coordinate, or an answer of the field, is NaN or infinite or too large.
    pub not_finite_count: usize,
}

/// Elements that one thread searches at a time: enough to fill all lanes but for the last, few enough to share.
pub(crate) const CHUNK: usize = 512;

/// Scratch space of the search for all minima of an element: half a megabyte a thread.
const MAX_PIECES: usize = 4096;

/// Minima of one element that are found at most; with more, its contacts are `BudgetSpent`.
const MAX_MINIMA: usize = 256;

pub(crate) fn find(field: &AnyField, mesh: MeshView, options: &ContactOptions) -> Result<Contacts, QueryError> {
    check(options)?;
    match options.elements {
        Elements::Faces => find_by_method(field, &Selection::all(mesh.points, mesh.faces)?, options),
        Elements::Edges => find_edges(field, mesh.points, &mesh.edges(), options),
        Elements::Vertices => find_vertices(field, mesh.points, &mesh.vertices(), options),
    }
}

pub(crate) fn find_vertices(
    field: &AnyField,
    points: &[[f64; 3]],
    vertices: &[[u32; 1]],
    options: &ContactOptions,
) -> Result<Contacts, QueryError> {
    check(options)?;
    // A point has one minimum, and every method finds it by one evaluation.
    find_by(field, &Selection::all(points, vertices)?, options, &FrankWolfe::default())
}

/// Refuses options that do not go together, and what is left of exact queries: a field that was built with the feature `bake` and keeps
/// its mesh has answered them before.
fn check(options: &ContactOptions) -> Result<(), QueryError> {
    options.check()?;
    if options.exact { Err(QueryError::MeshNotKept) } else { Ok(()) }
}

pub(crate) fn find_in_motion(
    field: &AnyField,
    mesh: &MeshInMotion,
    options: &ContactOptions,
) -> Result<Contacts, QueryError> {
    options.check()?;
    if options.exact {
        return Err(QueryError::ExactNotInMotion);
    }
    find_by_method(field, &Selection::near(field, mesh, options)?, options)
}

pub(crate) fn find_edges(
    field: &AnyField,
    points: &[[f64; 3]],
    edges: &[[u32; 2]],
    options: &ContactOptions,
) -> Result<Contacts, QueryError> {
    check(options)?;
    let edges = Selection::all(points, edges)?;
    if options.method == Method::GoldenSection && !options.all_minima {
        let method = GoldenSection { iterations: options.budget(), ..GoldenSection::default() };
        return find_by(field, &edges, options, &method);
    }
    find_by_method(field, &edges, options)
}

fn find_by_method<const N: usize>(
    field: &AnyField,
    elements: &Selection<N>,
    options: &ContactOptions,
) -> Result<Contacts, QueryError>
where
    PointSampling: Minimizer<N>,
{
    let iterations = options.budget();
    let certified = Certified { evaluations: iterations, tolerance: options.tolerance, ..Certified::default() };
    match options.method {
        Method::Auto | Method::Certified if options.all_minima => {
            find_all_minima(field, elements, options, &AllMinima { search: certified, ..AllMinima::default() })
        }
        _ if options.all_minima => Err(QueryError::AllMinimaNeedCertified),
        Method::Auto | Method::Certified => find_by(field, elements, options, &certified),
        Method::FrankWolfe => find_by(field, elements, options, &FrankWolfe { iterations, ..FrankWolfe::default() }),
        Method::ProjectedGradient => {
            let method = ProjectedGradient { iterations, ..ProjectedGradient::default() };
            find_by(field, elements, options, &method)
        }
        Method::Newton => find_by(field, elements, options, &Newton { iterations, ..Newton::default() }),
        Method::Sampling(samples) => find_by(field, elements, options, &PointSampling { samples, corners: false }),
        Method::SamplingWithCorners(samples) => {
            find_by(field, elements, options, &PointSampling { samples, corners: true })
        }
        Method::GoldenSection => Err(QueryError::GoldenSectionNeedsEdges),
    }
}

fn find_by<M: Minimizer<N> + Sync, const N: usize>(
    field: &AnyField,
    selection: &Selection<N>,
    options: &ContactOptions,
    minimizer: &M,
) -> Result<Contacts, QueryError> {
    let report = Report::new(field, selection, options)?;
    let search_chunk = |elements: Vec<Element<f64, N>>| {
        let each = report.search_margins(&elements);
        let margins = each.as_deref().map_or(CullMargins::All(report.error.reach(report.margin)), CullMargins::Each);
        let level = |element: &Element<f64, N>| report.reach(element);
        let (pose, lean) = (options.pose, options.lean);
        let query = Query { field, pose, margins, level: &level, elements: &elements, lean };
        let mut found = Contacts::default();
        for (index, outcome) in &query.outcomes(minimizer) {
            found.count(outcome);
            let contact = report.contact(&elements[*index], outcome);
            found.undecided_count += usize::from(contact.is_none() && report.is_undecided(&elements[*index], outcome));
            found.contacts.extend(contact);
        }
        found
    };
    let chunks = selection.map_chunks(options.threads, CHUNK, search_chunk);
    Ok(Contacts::join(selection.element_count(), chunks, options))
}

fn find_all_minima<const N: usize>(
    field: &AnyField,
    selection: &Selection<N>,
    options: &ContactOptions,
    search: &AllMinima,
) -> Result<Contacts, QueryError> {
    let report = Report::new(field, selection, options)?;
    let field = report.field;
    let search_chunk = |elements: Vec<Element<f64, N>>| {
        let (mut pieces, mut minima) = (vec![SimplexCell::default(); MAX_PIECES], vec![Minimum::default(); MAX_MINIMA]);
        let mut found = Contacts::default();
        for element in elements {
            let mut contacts = vec![];
            let visit = |contact: &Contact<f64>| contacts.push(*contact);
            let reach = report.reach(&element);
            let outcome = all_contacts(&field, search, reach, &element, &mut pieces, &mut minima, visit);
            found.count(&outcome);
            contacts.extend(report.of_separated(&element, &outcome));
            let first = found.contacts.len();
            found.contacts.extend(contacts.into_iter().filter_map(|contact| report.settle(&element, contact)));
            found.undecided_count +=
                usize::from(found.contacts.len() == first && report.is_undecided(&element, &outcome));
        }
        found
    };
    let chunks = selection.map_chunks(options.threads, CHUNK, search_chunk);
    Ok(Contacts::join(selection.element_count(), chunks, options))
}

/// Turns the outcome of a search into a contact, a possible one, or none.
struct Report<'a> {
    field: Posed<&'a AnyField>,
    margin: f64,
    /// The margin of each element, in place of the one for all.
    margins: Option<&'a [f64]>,
    complete: bool,
    /// The method proves that there is nothing within a margin.
    proves: bool,
    /// Error of the field around all elements, none unless the search is complete.
    error: ErrorBound,
}

impl<'a> Report<'a> {
    fn new<const N: usize>(
        field: &'a AnyField,
        selection: &Selection<'a, N>,
        options: &ContactOptions,
    ) -> Result<Self, QueryError> {
        let ContactOptions { margin, complete, pose, .. } = *options;
        let error = selection.error_bound(field, options);
        let is_unknown = |error: &ErrorBound| selection.largest_reach(error, options) == f64::INFINITY;
        if complete && is_unknown(&error) {
            let in_boxes = ErrorBound { fails_outside: [false; 2], ..error };
            return Err(match is_unknown(&in_boxes) {
                true => QueryError::ErrorBoundUnknown,
                false => QueryError::OutsideGridInCombination,
            });
        }
        // The one value of a vertex is all there is to know.
        let proves = N > 1 && matches!(options.method, Method::Auto | Method::Certified);
        Ok(Self { field: Posed { field, pose }, margin, margins: selection.margins(), complete, proves, error })
    }

    fn margin_of(&self, element: u32) -> f64 {
        self.margins.map_or(self.margin, |margins| margins[element as usize])
    }

    /// Margins of the cull, where each element has one of its own.
    fn search_margins<const N: usize>(&self, elements: &[Element<f64, N>]) -> Option<Vec<f64>> {
        let margins = self.margins?;
        Some(elements.iter().map(|element| self.error.reach(margins[element.id as usize])).collect())
    }

    /// How far an element must be searched: as far as the field can be off in its box.
    fn reach<const N: usize>(&self, element: &Element<f64, N>) -> f64 {
        let margin = self.margin_of(element.id);
        match self.complete {
            true => self.field.error_bound(&element.simplex.bounds()).reach(margin).min(self.error.reach(margin)),
            false => margin,
        }
    }

    fn contact<const N: usize>(&self, element: &Element<f64, N>, outcome: &Outcome<f64, N>) -> Option<Contact<f64>> {
        let contact = match outcome {
            Outcome::Contact(contact) => *contact,
            _ => self.of_separated(element, outcome)?,
        };
        self.settle(element, contact)
    }

    /// In a complete search an element's minimum above all margins counts too, as its lower bound may be below them.
    fn of_separated<const N: usize>(
        &self,
        element: &Element<f64, N>,
        outcome: &Outcome<f64, N>,
    ) -> Option<Contact<f64>> {
        match outcome {
            Outcome::Separated(minimum) if self.complete && minimum.lower_bound <= self.reach(element) => {
                contact_at(&self.field, element, minimum, f64::NEG_INFINITY)
            }
            _ => None,
        }
    }

    /// Whether an element without a contact may nevertheless be within the margin.
    fn is_undecided<const N: usize>(&self, element: &Element<f64, N>, outcome: &Outcome<f64, N>) -> bool {
        self.proves
            && matches!(outcome, Outcome::Separated(minimum) if minimum.lower_bound <= self.margin_of(element.id))
    }

    /// The contact where φ is within the margin; a possible one where the shape may be: some point of the element may have a φ of
    /// `lower_bound`, and be nearer by the field's error.
    fn settle<const N: usize>(&self, element: &Element<f64, N>, contact: Contact<f64>) -> Option<Contact<f64>> {
        let margin = self.margin_of(element.id);
        if contact.distance <= margin {
            return Some(contact);
        }
        let is_possible = self.complete && contact.lower_bound <= self.reach(element);
        is_possible.then_some(Contact { status: ContactStatus::Possible, ..contact })
    }
}

impl Contacts {
    pub(crate) fn count<const N: usize>(&mut self, outcome: &Outcome<f64, N>) {
        match outcome {
            Outcome::NotFinite => self.not_finite_count += 1,
            Outcome::Culled => {}
            Outcome::Separated(_) | Outcome::Contact(_) => self.searched_count += 1,
        }
    }

    pub(crate) fn join(element_count: usize, chunks: Vec<Self>, options: &ContactOptions) -> Self {
        let mut all = Self { element_count, ..Self::default() };
        all.contacts.reserve(chunks.iter().map(|chunk| chunk.contacts.len()).sum());
        for chunk in chunks {
            all.searched_count += chunk.searched_count;
            all.undecided_count += chunk.undecided_count;
            all.not_finite_count += chunk.not_finite_count;
            all.contacts.extend(chunk.contacts);
        }
        if options.one_per_feature {
            let count = one_per_feature(&mut all.contacts);
            all.contacts.truncate(count);
        }
        all.possible_count = all.contacts.iter().filter(|contact| contact.status == ContactStatus::Possible).count();
        all
    }
}
