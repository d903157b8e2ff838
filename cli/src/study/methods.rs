use sdf_core::Simplex;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::minimize::{
    Certified, FrankWolfe, GoldenSection, LineSearch, Minimizer, Minimum, Newton, PointSampling, ProjectedGradient,
};
use sdf_formats::field_file::Node;

/// A way to look for the least value, for any budget.
pub struct Method {
    pub name: &'static str,
    /// What a budget counts.
    pub unit: &'static str,
    /// What is taken of it where a program would leave the budget alone.
    pub usual: &'static [u32],
    faces: Option<Search<3>>,
    edges: Option<Search<2>>,
}

/// Every method that is measured. This is the only list of them.
pub fn methods() -> Vec<Method> {
    vec![
        of_both("sampling", "samples", &[4, 16, 64], |samples| PointSampling { samples }),
        of_both("projected gradient", "steps", &[32], |n| ProjectedGradient { iterations: n, ..Default::default() }),
        of_both("Frank-Wolfe", "steps", &[32], |n| FrankWolfe { iterations: n, ..Default::default() }),
        of_edges("golden section", "steps", &[32], |n| GoldenSection { iterations: n, ..Default::default() }),
        of_both("line search", "ways", &[8], |n| LineSearch { iterations: n, ..Default::default() }),
        of_both("Newton", "steps", &[32], |n| Newton { iterations: n, ..Default::default() }),
        // With 256 it is what `contacts --method auto` does.
        of_both("certified", "evaluations", &[128, 256], |n| Certified { evaluations: n, ..Default::default() }),
    ]
}

type Minimize<const N: usize> = dyn Fn(u32, &Node, &Simplex<f64, N>) -> Minimum<f64, N> + Send + Sync;
type Touch<const N: usize> = dyn Fn(u32, &Node, f64, &Element<f64, N>) -> Outcome<f64, N> + Send + Sync;

/// A method on one kind of element. The first argument is the budget.
pub struct Search<const N: usize> {
    pub minimize: Box<Minimize<N>>,
    /// As [`contact`], with the margin before the element.
    pub contact: Box<Touch<N>>,
}

impl<const N: usize> Search<N> {
    fn new<M: Minimizer<N> + 'static>(build: fn(u32) -> M) -> Self {
        Self {
            minimize: Box::new(move |budget, field, simplex| build(budget).minimize(field, simplex)),
            contact: Box::new(move |budget, field, margin, element| contact(field, &build(budget), margin, element)),
        }
    }
}

fn of_both<M>(name: &'static str, unit: &'static str, usual: &'static [u32], build: fn(u32) -> M) -> Method
where
    M: Minimizer<2> + Minimizer<3> + 'static,
{
    Method { name, unit, usual, faces: Some(Search::new(build)), edges: Some(Search::new(build)) }
}

fn of_edges<M>(name: &'static str, unit: &'static str, usual: &'static [u32], build: fn(u32) -> M) -> Method
where
    M: Minimizer<2> + 'static,
{
    Method { name, unit, usual, faces: None, edges: Some(Search::new(build)) }
}

/// What a method has for elements of `N` corners.
pub trait Searches<const N: usize> {
    const ELEMENTS: &'static str;

    /// `None` where the method is not for them.
    fn search(&self) -> Option<&Search<N>>;
}

impl Searches<2> for Method {
    const ELEMENTS: &'static str = "edges";

    fn search(&self) -> Option<&Search<2>> {
        self.edges.as_ref()
    }
}

impl Searches<3> for Method {
    const ELEMENTS: &'static str = "faces";

    fn search(&self) -> Option<&Search<3>> {
        self.faces.as_ref()
    }
}
