//! One HTML page with a slider: plain WebGL2, nothing from outside. Points are u16 within the recording's box, in base64; those beyond,
//! as of a run that explodes, are marked, and not drawn.

use super::Recording;

/// Most frames of a page; more are thinned out evenly.
const MAX_FRAMES: usize = 150;

/// Most bytes of frames: half of what a browser holds as one text.
const MAX_BYTES: usize = 256 << 20;

/// Bytes of a point in base64.
const POINT_BYTES: usize = 8;

/// The largest coordinate; of a point that is not drawn all are one above.
const LARGEST: u16 = u16::MAX - 1;

/// Indices of the frames that a page holds: 150, or of many points fewer, and two at least.
pub fn page_frames(recording: &Recording) -> impl Iterator<Item = usize> {
    let points = recording.frames.first().map_or(0, Vec::len);
    let most = MAX_BYTES / (POINT_BYTES * points.max(1));
    super::thinned(recording.frames.len(), most.min(MAX_FRAMES))
}

/// The page of a recording.
pub fn page(recording: &Recording) -> String {
    let bounds = recording.bounds();
    // The page computes in f32.
    let extents = bounds.extents().map(|extent| extent.max(f64::from(f32::MIN_POSITIVE)));
    let pack = |points: &[[f32; 3]]| {
        let pack = |point: &[f32; 3]| -> [u16; 3] {
            let share = |axis: usize| (f64::from(point[axis]) - bounds.min[axis]) / extents[axis];
            let shares = [0, 1, 2].map(share);
            match shares.iter().all(|share| (0.0..=1.0).contains(share)) {
                true => shares.map(|share| (share * f64::from(LARGEST)).round() as u16),
                false => [u16::MAX; 3],
            }
        };
        points.iter().flat_map(pack).flat_map(u16::to_le_bytes).collect::<Vec<u8>>()
    };
    let frames: Vec<&Vec<[f32; 3]>> = page_frames(recording).map(|index| &recording.frames[index]).collect();
    let times: Vec<f64> = page_frames(recording).map(|index| index as f64 / recording.rate).collect();
    let moving: Vec<u8> = frames.iter().flat_map(|points| pack(points)).collect();
    let indices = |indices: &[u32]| base64(&indices.iter().flat_map(|index| index.to_le_bytes()).collect::<Vec<u8>>());
    let head = serde_json::json!({
        "title": recording.title,
        "frames": frames.len(),
        "times": times,
        "bodyFaces": recording.body_face_count,
        "points": recording.frames.first().map_or(0, Vec::len),
        "min": bounds.min,
        "extents": extents,
    });
    // A title may hold what ends a script.
    let head = head.to_string().replace('<', "\\u003c");
    let title = recording.title.replace('&', "&amp;").replace('<', "&lt;");
    fill(&[
        ("TITLE", title),
        ("HEAD", head),
        ("MOVING", base64(&moving)),
        ("FACES", indices(recording.faces.as_flattened())),
        ("EDGES", indices(recording.edges.as_flattened())),
        ("STILL", base64(&pack(&recording.still_points))),
        ("STILLFACES", indices(recording.still_faces.as_flattened())),
    ])
}

/// The page with each `%NAME%` replaced, in one pass: what is filled in may hold another's name.
fn fill(values: &[(&str, String)]) -> String {
    let mut page = String::new();
    let mut is_name = false;
    for part in PAGE.split('%') {
        match values.iter().find(|(name, _)| is_name && *name == part) {
            Some((_, value)) => {
                page += value;
                is_name = false;
            }
            None => {
                page += if is_name { "%" } else { "" };
                page += part;
                is_name = true;
            }
        }
    }
    page
}

const PAGE: &str = include_str!("page.html");

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, index| bits << 8 | u32::from(group.get(index).copied().unwrap_or(0)));
        for digit in 0..4 {
            let digit_of = DIGITS[(bits >> (18 - 6 * digit) & 63) as usize];
            text.push(if digit <= group.len() { char::from(digit_of) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn base64_is_that_of_the_standard() {
        let pairs = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")];
        for (plain, coded) in pairs {
            assert_eq!(super::base64(plain.as_bytes()), coded);
        }
    }
}
