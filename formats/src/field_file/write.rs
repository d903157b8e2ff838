//! The text of a field in closed form: the reverse of `shapes` and `pose`, under the same names.
//!
//! Every number is written with the fewest digits that read as the same number, so the text reads as the same field,
//! bit for bit. Only a bare stretch is read with an identity pose around it, which changes signs of zero at most.
//!
//! | question | method |
//! |---|---|
//! | How is a list joined in pairs written? | As the longest list that joins to the same tree: `joined` |
//! | How is an angle in radians written? | In degrees if some number of degrees reads as the same angle: `angle` |
//! | Where does a pose stand on a posed field? | Around a union of that field alone, which reads as the field |
//! | Which tables are inline? | Those without parts; others have a header, so that depth is not bounded by the parser |

use std::path::Path;

use sdf_core::AnyField;
use sdf_core::placed::{Placement, Similarity, Stretch};

use super::{FieldError, MAX_DEPTH};

/// The text of a table, without its name.
struct TableText<'a> {
    /// `key = value` each: the shape, its numbers, its pose.
    keys: Vec<String>,
    parts: Parts<'a>,
}

/// The fields under the key `of`.
enum Parts<'a> {
    None,
    One(&'a AnyField),
    List(Vec<&'a AnyField>),
}

/// The text that reads as `field`. Errors show `path`.
pub(super) fn to_text(field: &AnyField, path: &Path) -> Result<String, FieldError> {
    let mut writer = Writer { path, text: String::new() };
    writer.table("[field]", "field", field, MAX_DEPTH)?;
    Ok(writer.text)
}

struct Writer<'a> {
    path: &'a Path,
    text: String,
}

impl Writer<'_> {
    /// A table with a header. `name` is that of the reader's errors, such as `field.of[1]`.
    fn table(&mut self, header: &str, name: &str, field: &AnyField, max_depth: usize) -> Result<(), FieldError> {
        let refuse = |what: String| FieldError::Refused { path: self.path.to_owned(), table: name.to_owned(), what };
        let Some(depth) = max_depth.checked_sub(1) else {
            return Err(refuse(format!(
                "is nested deeper than {MAX_DEPTH} shapes, so that it could not be read again"
            )));
        };
        let TableText { keys, parts } = describe(field).map_err(|what| refuse(what.to_owned()))?;
        let separator = if self.text.is_empty() { "" } else { "\n" };
        self.text += &format!("{separator}{header}\n");
        keys.iter().for_each(|key| self.text += &format!("{key}\n"));
        let key = header.trim_matches(['[', ']']);
        match parts {
            Parts::None => Ok(()),
            Parts::One(part) => {
                if let Some(table) = inline(part).filter(|_| depth > 0) {
                    self.text += &format!("of = {table}\n");
                    return Ok(());
                }
                self.table(&format!("[{key}.of]"), &format!("{name}.of"), part, depth)
            }
            Parts::List(parts) => {
                let tables: Option<Vec<String>> = parts.iter().map(|part| inline(part)).collect();
                if let Some(tables) = tables.filter(|_| depth > 0) {
                    self.text += &format!("of = [\n    {},\n]\n", tables.join(",\n    "));
                    return Ok(());
                }
                let mut parts = parts.into_iter().enumerate();
                parts.try_for_each(|(index, part)| {
                    self.table(&format!("[[{key}.of]]"), &format!("{name}.of[{index}]"), part, depth)
                })
            }
        }
    }
}

/// The field as an inline table, if it has no parts and can be written.
fn inline(field: &AnyField) -> Option<String> {
    let TableText { keys, parts: Parts::None } = describe(field).ok()? else { return None };
    Some(braces(&keys))
}

fn braces(keys: &[String]) -> String {
    if keys.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", keys.join(", ")) }
}

/// The table of a field; the error says what cannot be written.
fn describe(field: &AnyField) -> Result<TableText<'_>, &'static str> {
    let (posed, pose) = match alone(field) {
        AnyField::Placed(placed) => match &placed.field {
            // The reader makes this of a scale for each axis.
            AnyField::Stretched(stretched) if placed.placement.scale() == 1.0 => {
                (&stretched.field, pose(Some(&placed.placement), Some(&stretched.placement)))
            }
            field => (field, pose(Some(&placed.placement), None)),
        },
        AnyField::Stretched(stretched) => (&stretched.field, pose(None, Some(&stretched.placement))),
        shape => return describe_shape(shape),
    };
    let posed = alone(posed);
    let mut text = match posed {
        AnyField::Placed(_) | AnyField::Stretched(_) => table("union", [], Parts::List(vec![posed])),
        shape => describe_shape(shape)?,
    };
    text.keys.push(pose);
    Ok(text)
}

/// The part of a union that has one part, else the field.
fn alone(field: &AnyField) -> &AnyField {
    match field {
        AnyField::Union(union) if union.parts().len() == 1 => alone(&union.parts()[0]),
        _ => field,
    }
}

fn table<'a, const N: usize>(shape: &str, numbers: [(&str, String); N], parts: Parts<'a>) -> TableText<'a> {
    let shape = format!("shape = \"{shape}\"");
    let numbers = numbers.into_iter().map(|(key, value)| format!("{key} = {value}"));
    TableText { keys: std::iter::once(shape).chain(numbers).collect(), parts }
}

/// The table of a field without a pose.
fn describe_shape<'a>(field: &'a AnyField) -> Result<TableText<'a>, &'static str> {
    let none = Parts::None;
    Ok(match field {
        AnyField::Sphere(sphere) => table("sphere", [("radius", number(sphere.radius()))], none),
        AnyField::HalfSpace(half_space) => {
            let numbers = [("normal", list(half_space.given_normal())), ("offset", number(half_space.offset()))];
            table("half_space", numbers, none)
        }
        AnyField::Cuboid(cuboid) => table("box", [("half_extents", list(cuboid.half_extents()))], none),
        AnyField::RoundedBox(rounded) => {
            let numbers = [("half_extents", list(rounded.half_extents())), ("radius", number(rounded.radius()))];
            table("rounded_box", numbers, none)
        }
        AnyField::Capsule(capsule) => {
            let radius = ("radius", number(capsule.radius()));
            table("capsule", [("a", list(capsule.a())), ("b", list(capsule.b())), radius], none)
        }
        AnyField::Cylinder(cylinder) => {
            let numbers = [("radius", number(cylinder.radius())), ("half_height", number(cylinder.half_height()))];
            table("cylinder", numbers, none)
        }
        AnyField::Cone(cone) => {
            let half_angle = angle("half_angle_deg", "half_angle_rad", cone.half_angle());
            table("cone", [half_angle, ("height", number(cone.height()))], none)
        }
        AnyField::Torus(torus) => {
            let major_radius = ("major_radius", number(torus.major_radius()));
            table("torus", [major_radius, ("minor_radius", number(torus.minor_radius()))], none)
        }
        AnyField::Octahedron(octahedron) => table("octahedron", [("size", number(octahedron.size()))], none),
        AnyField::Ellipsoid(ellipsoid) => table("ellipsoid", [("radii", list(ellipsoid.radii()))], none),
        AnyField::Bowl(bowl) => {
            let cut_height = ("cut_height", number(bowl.cut_height()));
            let thickness = ("thickness", number(bowl.thickness()));
            table("bowl", [("radius", number(bowl.radius())), cut_height, thickness], none)
        }
        AnyField::Horseshoe(horseshoe) => {
            let numbers = [
                ("radius", number(horseshoe.radius())),
                ("thickness", number(horseshoe.thickness())),
                angle("bend_deg", "bend_rad", horseshoe.bend()),
                ("leg", number(horseshoe.leg())),
                ("half_depth", number(horseshoe.half_depth())),
            ];
            table("horseshoe", numbers, none)
        }
        AnyField::Grid(_) => {
            return Err("a grid cannot be written in TOML: save it as .sdf.h5 and name that file by hand, \
                        { shape = \"grid\", file = \"NAME.sdf.h5\" }");
        }
        AnyField::Union(union) => table("union", [], Parts::List(union.parts().iter().collect())),
        AnyField::Intersection(_) => {
            let pair = |field: &'a AnyField| match alone(field) {
                AnyField::Intersection(pair) => Some((&pair.0, &pair.1)),
                _ => None,
            };
            table("intersection", [], Parts::List(joined(field, usize::MAX, &pair)))
        }
        AnyField::Difference(difference) => {
            let mut parts = vec![&difference.0];
            match alone(&difference.1) {
                AnyField::Union(union) => parts.extend(union.parts()),
                other => parts.push(other),
            }
            table("difference", [], Parts::List(parts))
        }
        AnyField::SmoothUnion(union) => {
            let blend = union.blend();
            let pair = |field: &'a AnyField| match alone(field) {
                AnyField::SmoothUnion(pair) if pair.blend() == blend => Some(pair.parts()),
                _ => None,
            };
            table("smooth_union", [("blend", number(blend))], Parts::List(joined(field, usize::MAX, &pair)))
        }
        AnyField::Offset(offset) => {
            table("offset", [("distance", number(offset.distance()))], Parts::One(offset.field()))
        }
        AnyField::Shell(shell) => table("shell", [("thickness", number(shell.thickness()))], Parts::One(shell.field())),
        // They are described with their pose.
        AnyField::Placed(_) | AnyField::Stretched(_) => return describe(field),
    })
}

/// The two parts of a field, if it joins two.
type Pair<'a, 'f> = &'f dyn Fn(&'a AnyField) -> Option<(&'a AnyField, &'a AnyField)>;

/// The longest list that the reader joins to this tree, of at most 2^`max_depth` parts. Of n parts it joins the first
/// 2^k, with 2^k < n ≤ 2^(k+1), to a complete tree, and the rest by the same rule.
fn joined<'a>(field: &'a AnyField, max_depth: usize, pair: Pair<'a, '_>) -> Vec<&'a AnyField> {
    let Some((first, second)) = pair(field).filter(|_| max_depth > 0) else { return vec![field] };
    let depth = complete_depth(first, pair).min(max_depth - 1);
    let mut parts = vec![];
    push_complete(first, depth, pair, &mut parts);
    parts.extend(joined(second, depth, pair));
    parts
}

/// The depth to which every branch of the tree is joined.
fn complete_depth<'a>(field: &'a AnyField, pair: Pair<'a, '_>) -> usize {
    pair(field).map_or(0, |(first, second)| 1 + complete_depth(first, pair).min(complete_depth(second, pair)))
}

fn push_complete<'a>(field: &'a AnyField, depth: usize, pair: Pair<'a, '_>, parts: &mut Vec<&'a AnyField>) {
    match pair(field).filter(|_| depth > 0) {
        None => parts.push(field),
        Some((first, second)) => {
            push_complete(first, depth - 1, pair, parts);
            push_complete(second, depth - 1, pair, parts);
        }
    }
}

/// The key `pose`. What the reader has by default is left out.
fn pose(similarity: Option<&Similarity>, stretch: Option<&Stretch>) -> String {
    let mut keys = vec![];
    if let Some(similarity) = similarity {
        let (translation, rotation) = (similarity.translation(), similarity.rotation());
        if translation.map(f64::to_bits) != [0; 3] {
            keys.push(format!("translation = {}", list(translation)));
        }
        if rotation.map(f64::to_bits) != [0.0, 0.0, 0.0, 1.0_f64].map(f64::to_bits) {
            keys.push(format!("rotation = {}", list(rotation)));
        }
        if similarity.scale() != 1.0 {
            keys.push(format!("scale = {}", number(similarity.scale())));
        }
    }
    keys.extend(stretch.map(|stretch| format!("scale = {}", list(stretch.factors()))));
    format!("pose = {}", braces(&keys))
}

/// An angle under its key in degrees, or in radians if it lies between two that degrees give.
fn angle<'k>(degrees_key: &'k str, radians_key: &'k str, radians: f64) -> (&'k str, String) {
    let exact = radians.to_degrees();
    // Twelve decimals read as a round number where it was one.
    let round = format!("{exact:.12}").parse().unwrap_or(exact);
    let degrees = [round, exact, exact.next_down(), exact.next_up()];
    match degrees.into_iter().find(|degrees| degrees.to_radians() == radians) {
        Some(degrees) => (degrees_key, number(degrees)),
        None => (radians_key, number(radians)),
    }
}

/// The fewest digits that read as the same number.
fn number(x: f64) -> String {
    format!("{x:?}")
}

fn list<const N: usize>(numbers: [f64; N]) -> String {
    format!("[{}]", numbers.map(number).join(", "))
}
