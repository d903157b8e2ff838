//! Pictures of a run, drawn by a z-buffer: seen from the front, a little from above and from the right. Some frames side by side as a
//! PNG, or one after the other as an APNG ("PNG specification, third edition", §4.9), which viewers without animation show as a PNG.
//!
//! Pixels are indices into a palette of shades. In an animation a pixel that has not changed is transparent, and costs next to nothing.

use super::Recording;
use crate::V3;

/// Colours by [`Paint`].
const COLORS: [V3; 3] = [V3::new(196.0, 150.0, 96.0), V3::new(78.0, 132.0, 190.0), V3::new(62.0, 106.0, 152.0)];

/// Whose colour?
#[derive(Clone, Copy)]
enum Paint {
    Obstacle,
    Body,
    String,
}

/// Shades of a colour.
const SHADES: usize = 40;

/// Indices of the palette; shades follow.
const TRANSPARENT: u8 = 0;
const BACKGROUND: u8 = 1;

struct Canvas {
    size: usize,
    pixels: Vec<u8>,
    depth: Vec<f64>,
    center: V3,
    scale: f64,
}

/// Columns of pictures; more than so many frames begin a new row.
const COLUMNS: usize = 4;

/// The PNG file of `count` frames, evenly from the first to the last, each of `size` × `size` pixels.
pub fn contact_sheet(recording: &Recording, count: usize, size: usize) -> Vec<u8> {
    let last = recording.frames.len().saturating_sub(1);
    let count = count.clamp(1, recording.frames.len().max(1));
    let columns = count.min(COLUMNS);
    let [width, height] = [columns * size, count.div_ceil(columns) * size];
    let mut pixels = vec![BACKGROUND; width * height];
    let canvas = Canvas::new(recording, size);
    for place in 0..count {
        let drawn = canvas.draw(recording, place * last / (count - 1).max(1));
        for (row, line) in drawn.chunks(size).enumerate() {
            let start = (place / columns * size + row) * width + place % columns * size;
            pixels[start..start + size].copy_from_slice(line);
        }
    }
    encode([width, height], None, [pixels])
}

/// The APNG file of at most `count` frames, evenly over the run and the last, each of `size` × `size` pixels. It takes as long as the run,
/// to within a frame, with frames of whole milliseconds, at least 10 and at most 60,000.
pub fn animation(recording: &Recording, count: usize, size: usize) -> Vec<u8> {
    let stride = super::stride(recording.frames.len(), count);
    let mut shown: Vec<usize> = super::thinned(recording.frames.len(), count).collect();
    // A picture of what stands still has one frame.
    if shown.is_empty() {
        shown.push(0);
    }
    let canvas = Canvas::new(recording, size);
    let mut before = vec![TRANSPARENT; size * size];
    let images = shown.iter().map(|index| {
        let drawn = canvas.draw(recording, *index);
        let changed = |(new, old): (&u8, &u8)| if new == old { TRANSPARENT } else { *new };
        let image = drawn.iter().zip(&before).map(changed).collect();
        before = drawn;
        image
    });
    let milliseconds = (1000.0 * stride as f64 / recording.rate).round().clamp(10.0, 60_000.0) as u16;
    encode([size; 2], Some((shown.len() as u32, milliseconds)), images)
}

impl Canvas {
    fn new(recording: &Recording, size: usize) -> Self {
        let bounds = recording.bounds();
        let [min, max] = [V3::from(bounds.min), V3::from(bounds.max)];
        Self {
            size,
            pixels: vec![BACKGROUND; size * size],
            depth: vec![f64::NEG_INFINITY; size * size],
            center: (min + max) * 0.5,
            scale: 0.96 * size as f64 / (max - min).norm().max(f64::MIN_POSITIVE),
        }
    }

    /// The pixels of a frame; of one that is not there, only what stands still.
    fn draw(&self, recording: &Recording, frame: usize) -> Vec<u8> {
        let mut canvas = Self { pixels: self.pixels.clone(), depth: self.depth.clone(), center: self.center, ..*self };
        canvas.faces(&recording.still_points, &recording.still_faces, Paint::Obstacle);
        if let Some(points) = recording.frames.get(frame) {
            let (bodies, obstacles) = recording.faces.split_at(recording.body_face_count);
            canvas.faces(points, obstacles, Paint::Obstacle);
            canvas.faces(points, bodies, Paint::Body);
            for [a, b] in &recording.edges {
                canvas.line(points[*a as usize], points[*b as usize]);
            }
        }
        canvas.pixels
    }

    /// Right, up and towards the eye, in pixels.
    fn project(&self, point: [f32; 3]) -> V3 {
        let p = (V3::from(point.map(f64::from)) - self.center) * self.scale;
        let half = 0.5 * self.size as f64;
        let [right, up, near] = axes();
        V3::new(half + p.dot(&right), half - p.dot(&up), p.dot(&near))
    }

    fn faces(&mut self, points: &[[f32; 3]], faces: &[[u32; 3]], paint: Paint) {
        let projected: Vec<V3> = points.iter().map(|point| self.project(*point)).collect();
        let light = V3::new(0.3, -0.5, 0.8).normalize();
        for face in faces {
            let corners = face.map(|vertex| projected[vertex as usize]);
            if !corners.iter().all(|corner| corner.iter().all(|x| x.abs() < 1e6)) {
                continue;
            }
            let [a, b, c] = face.map(|vertex| V3::from(points[vertex as usize].map(f64::from)));
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or(light);
            // Both sides of a sheet are lit; the far one is darker.
            let facing = normal * normal.dot(&axes()[2]).signum();
            self.triangle(corners, shade(paint, 0.35 + 0.65 * facing.dot(&light).max(0.0)));
        }
    }

    fn triangle(&mut self, [a, b, c]: [V3; 3], color: u8) {
        let cross = |p: &V3, q: &V3, r: [f64; 2]| (q.x - p.x) * (r[1] - p.y) - (q.y - p.y) * (r[0] - p.x);
        let area = cross(&a, &b, [c.x, c.y]);
        if area == 0.0 {
            return;
        }
        let range = |low: f64, high: f64| low.max(0.0) as usize..(high + 1.0).clamp(0.0, self.size as f64) as usize;
        let columns = range(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        for row in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y)) {
            for column in columns.clone() {
                let at = [column as f64 + 0.5, row as f64 + 0.5];
                let weights = [cross(&b, &c, at) / area, cross(&c, &a, at) / area, cross(&a, &b, at) / area];
                if weights.iter().all(|weight| *weight >= 0.0) {
                    let near = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
                    self.set(column, row, near, color);
                }
            }
        }
    }

    fn line(&mut self, from: [f32; 3], to: [f32; 3]) {
        let [a, b] = [self.project(from), self.project(to)];
        let steps = ((b - a).norm() * 2.0).ceil().clamp(1.0, 1e4) as usize;
        for step in 0..=steps {
            let at = a.lerp(&b, step as f64 / steps as f64);
            if at.x >= 0.0 && at.y >= 0.0 && at.x < self.size as f64 && at.y < self.size as f64 {
                self.set(at.x as usize, at.y as usize, at.z + 1.0, shade(Paint::String, 1.0));
            }
        }
    }

    fn set(&mut self, column: usize, row: usize, near: f64, color: u8) {
        let index = row * self.size + column;
        if near > self.depth[index] {
            self.depth[index] = near;
            self.pixels[index] = color;
        }
    }
}

/// Right, up and towards the eye.
fn axes() -> [V3; 3] {
    let near = V3::new(0.45, -1.0, 0.5).normalize();
    let right = V3::z().cross(&near).normalize();
    [right, near.cross(&right), near]
}

/// The index of a colour times a brightness from 0 to 1.
fn shade(paint: Paint, brightness: f64) -> u8 {
    let shade = (brightness.clamp(0.0, 1.0) * (SHADES - 1) as f64).round() as usize;
    (2 + paint as usize * SHADES + shade) as u8
}

fn palette() -> Vec<u8> {
    let shades =
        COLORS.iter().flat_map(|color| (0..SHADES).map(move |shade| color * (shade as f64 / (SHADES - 1) as f64)));
    let shades = shades.flat_map(|color| [color.x, color.y, color.z].map(|part| part as u8));
    [0, 0, 0, 250, 250, 250].into_iter().chain(shades).collect()
}

/// The file of one image, or of so many that are each shown for some milliseconds.
fn encode(
    [width, height]: [usize; 2],
    animated: Option<(u32, u16)>,
    images: impl IntoIterator<Item = Vec<u8>>,
) -> Vec<u8> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    encoder.set_trns(vec![0]);
    encoder.set_compression(png::Compression::High);
    // Neighbouring indices say nothing of each other's colours.
    encoder.set_filter(png::Filter::NoFilter);
    // Writing into memory does not fail.
    let write = || -> Result<(), png::EncodingError> {
        if let Some((count, milliseconds)) = animated {
            encoder.set_animated(count, 0)?;
            encoder.set_frame_delay(milliseconds, 1000)?;
            encoder.set_blend_op(png::BlendOp::Over)?;
            encoder.set_dispose_op(png::DisposeOp::None)?;
        }
        let mut writer = encoder.write_header()?;
        images.into_iter().try_for_each(|image| writer.write_image_data(&image))?;
        writer.finish()
    };
    _ = write();
    bytes
}
