use clap::builder::{PossibleValuesParser, TypedValueParser};
use sdf_field::Method;

/// Methods by the names that `sdftool contacts --method` has for them.
const METHODS: [(&str, Method); 9] = [
    ("auto", Method::Auto),
    ("pgd", Method::ProjectedGradient),
    ("fw", Method::FrankWolfe),
    ("ls", Method::LineSearch),
    ("newton", Method::Newton),
    ("certified", Method::Certified),
    ("sample4", Method::Sampling(4)),
    ("sample16", Method::Sampling(16)),
    ("sample64", Method::Sampling(64)),
];

/// Parses the value of --method.
pub fn parser() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(METHODS.map(|(name, _)| name)).map(|given| {
        let known = METHODS.into_iter().find(|(name, _)| *name == given);
        known.expect("clap has checked the name").1
    })
}

pub fn name(method: Method) -> &'static str {
    METHODS.into_iter().find(|(_, known)| *known == method).map_or("", |(name, _)| name)
}
