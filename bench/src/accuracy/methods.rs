//! The methods that are measured, each with its budget left open.

use sdf_core::AnyField;
use sdf_core::Simplex;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::minimize::{
    Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, Newton, PointSampling, ProjectedGradient,
};

/// A minimizer with a budget left open.
pub struct Method {
    pub name: &'static str,
    /// Unit of a budget.
    pub unit: &'static str,
    /// Budgets that a program would choose.
    pub usual_budgets: &'static [u32],
    faces: Option<Budgeted<3>>,
    edges: Option<Budgeted<2>>,
}

/// Every method that is measured, in the order of all pages.
pub fn methods() -> Vec<Method> {
    vec![
        both("sampling", "samples", &[4, 16, 64], |samples| PointSampling { samples, corners: false }),
        // As programs sample that collide vertices, too.
        both("corners and samples", "samples", &[4, 64], |samples| PointSampling { samples, corners: true }),
        both("projected gradient", "steps", &[8, 32], |n| ProjectedGradient { iterations: n, ..Default::default() }),
        both("Frank-Wolfe", "steps", &[32], |n| FrankWolfe { iterations: n, ..Default::default() }),
        edges_only("golden section", "steps", &[32], |n| GoldenSection { iterations: n, ..Default::default() }),
        both("Newton", "steps", &[32], |n| Newton { iterations: n, ..Default::default() }),
        // 256 evaluations are the default of `sdftool contacts`.
        both("certified", "evaluations", &[128, 256], |n| Certified { evaluations: n, ..Default::default() }),
    ]
}

type Minimize<const N: usize> = dyn Fn(u32, &AnyField, &Simplex<f64, N>) -> Minimum<f64, N> + Send + Sync;
type FindContact<const N: usize> = dyn Fn(u32, &AnyField, f64, &Element<f64, N>) -> Outcome<f64, N> + Send + Sync;

/// A method for elements of `N` corners. The first argument of each function is the budget.
pub struct Budgeted<const N: usize> {
    pub minimize: Box<Minimize<N>>,
    /// [`contact`], with the margin before the element.
    pub contact: Box<FindContact<N>>,
}

impl<const N: usize> Budgeted<N> {
    fn new<M: Minimizer<N> + 'static>(build: fn(u32) -> M) -> Self {
        Self {
            minimize: Box::new(move |budget, field, simplex| build(budget).minimize(field, simplex)),
            contact: Box::new(move |budget, field, margin, element| contact(field, &build(budget), margin, element)),
        }
    }
}

fn both<M>(name: &'static str, unit: &'static str, usual_budgets: &'static [u32], build: fn(u32) -> M) -> Method
where
    M: Minimizer<2> + Minimizer<3> + 'static,
{
    Method { name, unit, usual_budgets, faces: Some(Budgeted::new(build)), edges: Some(Budgeted::new(build)) }
}

fn edges_only<M>(name: &'static str, unit: &'static str, usual_budgets: &'static [u32], build: fn(u32) -> M) -> Method
where
    M: Minimizer<2> + 'static,
{
    Method { name, unit, usual_budgets, faces: None, edges: Some(Budgeted::new(build)) }
}

/// The part of a method that is for elements of `N` corners.
pub trait ElementMethod<const N: usize> {
    const ELEMENTS: &'static str;

    /// `None` if the method is not for such elements.
    fn budgeted(&self) -> Option<&Budgeted<N>>;
}

impl ElementMethod<2> for Method {
    const ELEMENTS: &'static str = "edges";

    fn budgeted(&self) -> Option<&Budgeted<2>> {
        self.edges.as_ref()
    }
}

impl ElementMethod<3> for Method {
    const ELEMENTS: &'static str = "faces";

    fn budgeted(&self) -> Option<&Budgeted<3>> {
        self.faces.as_ref()
    }
}
