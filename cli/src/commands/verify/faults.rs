use super::findings::{Findings, SLOPE_TOLERANCE};
use crate::report::{counted, number};

/// Reasons why the field does not match its mesh; empty if it does.
pub fn faults(findings: &Findings) -> Vec<String> {
    let mut faults = Vec::new();
    if let Some(nodes) = &findings.nodes {
        if nodes.beyond_rounding > findings.node_tolerance {
            faults.push(format!("a node is wrong by {}", number(nodes.max)));
        }
        if nodes.wrong_signs > 0 {
            faults.push(wrong_signs(nodes.wrong_signs, "node", ""));
        }
    }
    if let Some(far) = &findings.far_nodes {
        if far.excess > findings.node_tolerance {
            faults.push(format!("a node beyond the band is wrong by {}", number(far.excess)));
        }
        if far.wrong_signs > 0 {
            faults.push(wrong_signs(far.wrong_signs, "node", " beyond the band"));
        }
    }
    let Some(bound) = findings.bound else { return faults };
    let points = &findings.points;
    if points.max > bound {
        faults.push(format!("a point is wrong by {}, more than the certified {}", number(points.max), number(bound)));
    }
    if points.wrong_signs > 0 {
        faults.push(wrong_signs(points.wrong_signs, "point", ""));
    }
    if let Some(count) = findings.beyond_their_brick.filter(|count| *count > 0) {
        let bricks = if count == 1 { "its brick certifies" } else { "their bricks certify" };
        faults.push(format!("{} {} wrong by more than {bricks}", counted(count, "point"), are(count)));
    }
    if let Some(far) = &findings.far {
        if far.over_outside > bound {
            let over = number(far.over_outside);
            faults.push(format!("a point beyond the band claims {over} more than its distance"));
        }
        if far.beyond_deep_error > bound {
            let beyond = number(far.beyond_deep_error);
            faults.push(format!("a point deep inside is wrong by {beyond} more than the file states"));
        }
        if far.wrong_signs > 0 {
            faults.push(wrong_signs(far.wrong_signs, "point", " beyond the band"));
        }
    }
    if let Some(count) = findings.missing_cells.filter(|count| *count > 0) {
        faults.push(format!("{} of the band {} missing", counted(count, "cell"), are(count)));
    }
    if let Some(slope) = findings.slope.as_ref().filter(|slope| slope.steepest > slope.bound * (1.0 + SLOPE_TOLERANCE))
    {
        faults.push(format!(
            "a gradient is {}, more than the certified {}",
            number(slope.steepest),
            number(slope.bound)
        ));
    }
    let beyond = findings.beyond_their_region;
    if beyond > 0 {
        let what = counted(beyond, "point");
        faults.push(format!("{what} {} wrong by more than the file states of where the error is large", are(beyond)));
    }
    let beyond = findings.beyond_block_bounds;
    if beyond > 0 {
        faults.push(format!(
            "{} {} outside of the bounds of values and slopes that blocks state",
            counted(beyond, "point"),
            are(beyond)
        ));
    }
    if let Some([stated, room]) = findings.padding.filter(|[stated, room]| *stated > room + findings.node_tolerance) {
        faults.push(format!(
            "the mesh is {} from the box's faces, less than the padding of {}",
            number(room),
            number(stated)
        ));
    }
    faults
}

fn wrong_signs(count: usize, what: &str, place: &str) -> String {
    format!("{}{place} {} the wrong sign", counted(count, what), if count == 1 { "has" } else { "have" })
}

fn are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}
