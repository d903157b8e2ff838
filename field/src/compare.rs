//! Every method on one mesh and one field: error against run time, and which to take.
//!
//! The reference is the certified search with a budget of 16,384 evaluations per element. A method's error on an element is its
//! lowest φ minus the reference's, over all elements that are contacts by the reference; a contact that the method does not
//! report is missed, and its error counts too.

use std::time::Instant;

use sdf_core::EnclosedSdf;
use sdf_core::contact::{Contact, ContactStatus, Element};
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Minimizer, Newton, PointSampling, ProjectedGradient};
use sdf_core::placed::Posed;

use crate::mesh_view::element;
use crate::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError};

/// Errors, time and counts of a method on one mesh and one field.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodReport {
    /// The method, with its default budget.
    pub method: Method,
    /// Median time of a query.
    pub seconds: f64,
    /// Evaluations of φ, summed over the contacts that it reports.
    pub evaluations: u64,
    /// Contacts that it reports.
    pub contacts: usize,
    /// Contacts of the reference that it does not report.
    pub missed: usize,
    /// 95 % of the errors are at most this, in the unit of the mesh.
    pub error_95: f64,
    /// The largest error.
    pub error_worst: f64,
}

/// All methods on one mesh and one field.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Elements of the mesh.
    pub elements: usize,
    /// Elements that were skipped, see [`Contacts::not_finite_count`].
    pub not_finite: usize,
    /// Contacts of the reference.
    pub contacts: usize,
    /// Contacts of the reference whose lowest φ is proven: its lower bound is within tolerance · slope bound · longest edge of the element, or
    /// size of the field if that is shorter.
    pub proven: usize,
    /// The fastest method that misses no contact and keeps 95 % of its errors within tolerance · median longest edge of the
    /// contacts' elements; [`Method::Auto`] where none does, where none is 1.25 times as fast, or where there are no contacts.
    pub recommended: Method,
    /// In the order of [`Method::ALL`]; golden section on edges alone.
    pub methods: Vec<MethodReport>,
    /// The methods that also ran on a card; of the mesh and the field, which stay there, no copying is in their time.
    pub on_card: Vec<MethodReport>,
}

/// Evaluations of the reference per element.
const REFERENCE_BUDGET: u32 = 16_384;

/// A method that runs elsewhere.
pub(crate) type Guest<'a> = (Method, Box<dyn FnMut() -> Option<Contacts> + 'a>);

impl Field {
    /// Runs every method `rounds` times, in turns so that a change of the machine's speed hits all alike. The method and budget
    /// of `options` do not matter, nor do all minima and one contact for each feature. Vertices need no search: they are compared as faces.
    pub fn compare(
        &self,
        mesh: MeshView,
        options: &ContactOptions,
        rounds: usize,
        on_done: &dyn Fn(usize),
    ) -> Result<Comparison, QueryError> {
        self.compare_with(mesh, options, rounds, on_done, vec![])
    }

    /// [`compare`](Self::compare), with guests beside the methods.
    pub(crate) fn compare_with(
        &self,
        mesh: MeshView,
        options: &ContactOptions,
        rounds: usize,
        on_done: &dyn Fn(usize),
        mut guests: Vec<Guest>,
    ) -> Result<Comparison, QueryError> {
        let edges = if options.elements == Elements::Edges { mesh.edges() } else { vec![] };
        let run = |method: Method, budget: Option<u32>, tolerance: f64| {
            let options =
                ContactOptions { method, budget, tolerance, all_minima: false, one_per_feature: false, ..*options };
            match options.elements {
                Elements::Edges => self.contacts_of_edges(mesh.points, &edges, &options),
                Elements::Faces | Elements::Vertices => {
                    self.contacts(mesh, &ContactOptions { elements: Elements::Faces, ..options })
                }
            }
        };
        let reference = run(Method::Certified, Some(REFERENCE_BUDGET), options.tolerance * 0.1)?;
        let is_compared = |method: &Method| *method != Method::GoldenSection || options.elements == Elements::Edges;
        let methods: Vec<Method> = Method::ALL.into_iter().filter(is_compared).collect();
        let mut times = vec![vec![]; methods.len()];
        let mut found = vec![Contacts::default(); methods.len()];
        let mut guest_times = vec![vec![]; guests.len()];
        let mut guest_found = vec![Contacts::default(); guests.len()];
        for _ in 0..rounds.max(1) {
            for (index, method) in methods.iter().enumerate() {
                let started = Instant::now();
                found[index] = run(*method, None, options.tolerance)?;
                times[index].push(started.elapsed().as_secs_f64());
                on_done(1);
            }
            for (index, (_, run)) in guests.iter_mut().enumerate() {
                let started = Instant::now();
                guest_found[index] = run().unwrap_or_default();
                guest_times[index].push(started.elapsed().as_secs_f64());
            }
        }
        let field = Posed { field: self.as_any(), pose: options.pose };
        let report = |((method, times), found): ((Method, Vec<f64>), Contacts)| {
            let errors = match options.elements {
                Elements::Edges => errors(&field, method, mesh.points, &edges, &reference, &found),
                Elements::Faces | Elements::Vertices => {
                    errors(&field, method, mesh.points, mesh.faces, &reference, &found)
                }
            };
            report(method, times, &found, errors)
        };
        let reports: Vec<_> = methods.into_iter().zip(times).zip(found).map(report).collect();
        let guests = guests.iter().map(|(method, _)| *method);
        let on_card = guests.zip(guest_times).zip(guest_found).map(report).collect();
        let longest_edge = |contact: &Contact<f64>| longest_edge(mesh, &edges, options, contact);
        let is_proven = |contact: &&Contact<f64>| is_proven(&field, contact, longest_edge(contact), options.tolerance);
        let proven = reference.contacts.iter().filter(is_proven).count();
        let longest = median(reference.contacts.iter().map(longest_edge).collect());
        let is_good = |report: &&MethodReport| report.missed == 0 && report.error_95 <= options.tolerance * longest;
        // Without contacts every method is good, and the fastest says nothing.
        let good = reports.iter().filter(is_good).filter(|_| !reference.contacts.is_empty());
        Ok(Comparison {
            elements: reference.element_count,
            not_finite: reference.not_finite_count,
            contacts: reference.contacts.len(),
            proven,
            recommended: recommended(good),
            methods: reports,
            on_card,
        })
    }
}

/// A method that is less than so many times as fast as auto is not worth leaving auto for: times vary by as much.
const WORTHWHILE: f64 = 1.25;

/// The fastest of the methods that are good enough; auto where it is about as fast, or where there is none.
fn recommended<'a>(good: impl Iterator<Item = &'a MethodReport> + Clone) -> Method {
    let auto = good.clone().find(|report| report.method == Method::Auto);
    let fastest = good.min_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let is_worthwhile = |report: &&MethodReport| auto.is_none_or(|auto| auto.seconds >= WORTHWHILE * report.seconds);
    fastest.filter(is_worthwhile).map_or(Method::Auto, |report| report.method)
}

/// Whether no φ on the element is lower than the contact's by more than the tolerance, whatever else is in doubt by its status. Of one that
/// converged this holds up to rounding.
fn is_proven<F: EnclosedSdf>(field: &F, contact: &Contact<f64>, longest_edge: f64, tolerance: f64) -> bool {
    let gap = tolerance * field.slope_bound() * longest_edge.min(field.extent());
    contact.status == ContactStatus::Converged || contact.distance - contact.lower_bound <= gap
}

fn longest_edge(mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions, contact: &Contact<f64>) -> f64 {
    let id = contact.element as usize;
    match options.elements {
        Elements::Edges => element(mesh.points, id, edges[id]).simplex.longest_edge(),
        Elements::Faces | Elements::Vertices => element(mesh.points, id, mesh.faces[id]).simplex.longest_edge(),
    }
}

/// For each contact of the reference the method's error, and whether the method missed it.
fn errors<F: EnclosedSdf, const N: usize>(
    field: &F,
    method: Method,
    points: &[[f64; 3]],
    elements: &[[u32; N]],
    reference: &Contacts,
    found: &Contacts,
) -> Vec<(f64, bool)>
where
    PointSampling: Minimizer<N>,
{
    let mut found = found.contacts.iter().peekable();
    let error = |contact: &Contact<f64>| {
        while found.next_if(|other| other.element < contact.element).is_some() {}
        match found.next_if(|other| other.element == contact.element) {
            Some(other) => (other.distance - contact.distance, false),
            None => {
                let id = contact.element as usize;
                (lowest(field, method, &element(points, id, elements[id])) - contact.distance, true)
            }
        }
    };
    // A method can be lower than the reference by what the reference leaves open.
    reference.contacts.iter().map(error).map(|(error, missed)| (error.max(0.0), missed)).collect()
}

/// The lowest φ that the method finds on an element, without a cull.
fn lowest<F: EnclosedSdf, const N: usize>(field: &F, method: Method, element: &Element<f64, N>) -> f64
where
    PointSampling: Minimizer<N>,
{
    let simplex = &element.simplex;
    let budget = method.default_budget();
    let minimum = match method {
        Method::Auto | Method::Certified => {
            Certified { evaluations: budget, ..Certified::default() }.minimize(field, simplex)
        }
        Method::FrankWolfe => FrankWolfe { iterations: budget, ..FrankWolfe::default() }.minimize(field, simplex),
        Method::ProjectedGradient => {
            ProjectedGradient { iterations: budget, ..ProjectedGradient::default() }.minimize(field, simplex)
        }
        Method::Newton => Newton { iterations: budget, ..Newton::default() }.minimize(field, simplex),
        Method::Sampling(samples) => PointSampling { samples, corners: false }.minimize(field, simplex),
        Method::SamplingWithCorners(samples) => PointSampling { samples, corners: true }.minimize(field, simplex),
        Method::GoldenSection => match simplex.corners.as_slice() {
            &[a, b] => {
                let edge = sdf_core::Simplex { corners: [a, b] };
                return GoldenSection { iterations: budget, ..GoldenSection::default() }
                    .minimize(field, &edge)
                    .sample
                    .value;
            }
            _ => Newton::default().minimize(field, simplex),
        },
    };
    minimum.sample.value
}

fn report(method: Method, times: Vec<f64>, found: &Contacts, errors: Vec<(f64, bool)>) -> MethodReport {
    let missed = errors.iter().filter(|(_, missed)| *missed).count();
    let mut errors: Vec<f64> = errors.into_iter().map(|(error, _)| error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let rank = (errors.len() as f64 * 0.95).ceil() as usize;
    MethodReport {
        method,
        seconds: median(times),
        evaluations: found.contacts.iter().map(|contact| u64::from(contact.evaluations)).sum(),
        contacts: found.contacts.len(),
        missed,
        error_95: rank.checked_sub(1).and_then(|rank| errors.get(rank)).copied().unwrap_or(0.0),
        error_worst: errors.last().copied().unwrap_or(0.0),
    }
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use sdf_core::shapes::Cuboid;

    use super::*;

    #[test]
    fn auto_is_recommended_where_no_good_method_is_a_quarter_faster() {
        let report = |method, seconds| {
            let (error_95, error_worst) = (0.0, 0.0);
            MethodReport { method, seconds, evaluations: 1, contacts: 1, missed: 0, error_95, error_worst }
        };
        let auto = report(Method::Auto, 1.0);
        for (seconds, method) in [(0.5, Method::Certified), (0.85, Method::Auto), (1.2, Method::Auto)] {
            assert_eq!(recommended([&auto, &report(Method::Certified, seconds)].into_iter()), method, "{seconds}");
        }
        assert_eq!(recommended([&report(Method::Certified, 2.0)].into_iter()), Method::Certified);
        assert_eq!(recommended([].into_iter()), Method::Auto);
    }

    /// The lowest point of a face through the axis of a box lies where its gradient jumps: the normal is a choice, the depth is not.
    #[test]
    fn a_contact_without_a_gradient_is_proven_by_its_lower_bound() {
        let field = Field::new(Cuboid::new([1.0; 3]).unwrap());
        let points = [[-1.0, -0.5, 0.0], [2.0, -0.5, 0.0], [-1.0, 1.0, 0.0]];
        let mesh = MeshView { points: &points, faces: &[[0, 1, 2]] };
        let found = field.contacts(mesh, &ContactOptions::default()).unwrap().contacts[0];
        assert_eq!(found.status, ContactStatus::DegenerateGradient);
        let compared = field.compare(mesh, &ContactOptions::default(), 1, &|_| ()).unwrap();
        assert_eq!((compared.contacts, compared.proven), (1, 1));
        let is_proven = |lower_bound: f64| is_proven(field.as_any(), &Contact { lower_bound, ..found }, 3.0, 1e-3);
        assert!(is_proven(found.distance - 1.9e-3) && !is_proven(found.distance - 2.1e-3));
    }
}
