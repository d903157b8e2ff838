//! Every minimizer in one type, so that a law is written once and checked for all of them.

use sdf_core::minimize::{
    Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, Newton, PointSampling, ProjectedGradient,
};
use sdf_core::{EnclosedSdf, Real, Simplex};

#[derive(Clone, Copy, Debug)]
pub enum Method {
    FrankWolfe(FrankWolfe),
    ProjectedGradient(ProjectedGradient),
    PointSampling(PointSampling),
    Newton(Newton),
    Certified(Certified),
    /// Segments only.
    GoldenSection(GoldenSection),
}

/// Every method for simplices of `corners` corners, with `budget` steps, `budget + 1` samples or `4 * budget` evaluations.
pub fn methods(corners: usize, budget: u32) -> Vec<Method> {
    let mut methods = vec![
        Method::FrankWolfe(FrankWolfe { iterations: budget, ..FrankWolfe::default() }),
        Method::ProjectedGradient(ProjectedGradient { iterations: budget, ..ProjectedGradient::default() }),
        Method::PointSampling(PointSampling { samples: budget + 1, corners: false }),
        Method::Newton(Newton { iterations: budget, ..Newton::default() }),
        Method::Certified(Certified { evaluations: 4 * budget, ..Certified::default() }),
    ];
    if corners == 2 {
        methods.push(Method::GoldenSection(GoldenSection { iterations: budget, ..GoldenSection::default() }));
    }
    methods
}

macro_rules! minimizer_of {
    ($corners:literal, $golden_section:expr) => {
        impl Minimizer<$corners> for Method {
            fn quick_pass(&self) -> Option<Self> {
                match self {
                    Self::FrankWolfe(method) => Minimizer::<$corners>::quick_pass(method).map(Self::FrankWolfe),
                    Self::ProjectedGradient(method) => {
                        Minimizer::<$corners>::quick_pass(method).map(Self::ProjectedGradient)
                    }
                    _ => None,
                }
            }

            fn minimize<R: Real, F: EnclosedSdf>(
                &self,
                field: &F,
                simplex: &Simplex<R, $corners>,
            ) -> Minimum<R, $corners> {
                match self {
                    Self::FrankWolfe(method) => method.minimize(field, simplex),
                    Self::ProjectedGradient(method) => method.minimize(field, simplex),
                    Self::PointSampling(method) => method.minimize(field, simplex),
                    Self::Newton(method) => method.minimize(field, simplex),
                    Self::Certified(method) => method.minimize(field, simplex),
                    Self::GoldenSection(method) => $golden_section(method, field, simplex),
                }
            }

            fn minimize_below<R: Real, F: EnclosedSdf>(
                &self,
                field: &F,
                simplex: &Simplex<R, $corners>,
                level: R,
            ) -> Minimum<R, $corners> {
                match self {
                    Self::Certified(method) => method.minimize_below(field, simplex, level),
                    other => other.minimize(field, simplex),
                }
            }
        }
    };
}

minimizer_of!(1, segments_only);
minimizer_of!(2, GoldenSection::minimize);
minimizer_of!(3, segments_only);

fn segments_only<R: Real, F: EnclosedSdf, const N: usize>(
    _: &GoldenSection,
    _: &F,
    _: &Simplex<R, N>,
) -> Minimum<R, N> {
    panic!("golden section minimizes on segments only, not on {N} corners")
}
