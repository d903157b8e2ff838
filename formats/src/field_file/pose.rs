use sdf_core::AnyField;
use sdf_core::placed::{Placed, Similarity, Stretch};

use super::FieldError;
use super::table::Table;

/// A placement: first a scale for each axis, if there is one, then scale, rotation and translation.
pub(super) struct Pose {
    stretch: Option<Stretch>,
    similarity: Similarity,
}

impl Pose {
    pub(super) fn read(mut table: Table) -> Result<Self, FieldError> {
        let translation = table.optional_numbers("translation")?.unwrap_or([0.0; 3]);
        let rotation = table.optional_numbers("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let (stretch, scale) = if table.is_list("scale") {
            let factors = table.numbers("scale")?;
            let why = if factors.contains(&0.0) { "must not be zero" } else { "is too small" };
            let stretch = Stretch::new(factors).ok_or_else(|| table.refuse(format!("the scale of an axis {why}")))?;
            (Some(stretch), 1.0)
        } else {
            (None, table.optional_number("scale")?.unwrap_or(1.0))
        };
        let similarity = Similarity::new(translation, rotation, scale);
        let similarity = similarity.ok_or_else(|| {
            table.refuse(match scale > 0.0 && rotation != [0.0; 4] {
                true => "scale is too small",
                false => {
                    "rotation must not be zero and scale must be positive; a list such as [-1.0, 1.0, 1.0] mirrors"
                }
            })
        })?;
        table.finish()?;
        Ok(Self { stretch, similarity })
    }

    pub(super) fn place(self, node: AnyField) -> AnyField {
        let field = match self.stretch {
            Some(placement) => AnyField::Stretched(Box::new(Placed { field: node, placement })),
            None => node,
        };
        AnyField::Placed(Box::new(Placed { field, placement: self.similarity }))
    }
}
