//! A PNG of some frames side by side, drawn by a z-buffer: seen from the front, a little from above and from the right.

use super::Recording;
use crate::V3;

const STILL: V3 = V3::new(196.0, 150.0, 96.0);
const MOVING: V3 = V3::new(78.0, 132.0, 190.0);

struct Canvas {
    size: usize,
    pixels: Vec<[u8; 3]>,
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
    let rows = count.div_ceil(columns);
    let [width, height] = [columns * size, rows * size];
    let mut pixels = vec![[255; 3]; width * height];
    let nothing = vec![];
    for place in 0..count {
        let frame = recording.frames.get(place * last / (count - 1).max(1)).unwrap_or(&nothing);
        let canvas = draw(recording, frame, size);
        for (row, line) in canvas.pixels.chunks(size).enumerate() {
            let start = (place / columns * size + row) * width + place % columns * size;
            pixels[start..start + size].copy_from_slice(line);
        }
    }
    encode(&pixels, width, height)
}

fn draw(recording: &Recording, frame: &[[f32; 3]], size: usize) -> Canvas {
    let bounds = recording.bounds();
    let [min, max] = [V3::from(bounds.min), V3::from(bounds.max)];
    let mut canvas = Canvas {
        size,
        pixels: vec![[250; 3]; size * size],
        depth: vec![f64::NEG_INFINITY; size * size],
        center: (min + max) * 0.5,
        scale: 0.96 * size as f64 / (max - min).norm().max(1e-9),
    };
    canvas.faces(&recording.still_points, &recording.still_faces, &STILL);
    canvas.faces(frame, &recording.faces, &MOVING);
    for [a, b] in &recording.edges {
        canvas.line(frame[*a as usize], frame[*b as usize]);
    }
    canvas
}

impl Canvas {
    /// Right, up and towards the eye, in pixels.
    fn project(&self, point: [f32; 3]) -> V3 {
        let p = (V3::from(point.map(f64::from)) - self.center) * self.scale;
        let half = 0.5 * self.size as f64;
        let [right, up, near] = axes();
        V3::new(half + p.dot(&right), half - p.dot(&up), p.dot(&near))
    }

    fn faces(&mut self, points: &[[f32; 3]], faces: &[[u32; 3]], color: &V3) {
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
            let shade = 0.35 + 0.65 * facing.dot(&light).max(0.0);
            self.triangle(corners, color.map(|part| (part * shade).min(255.0)));
        }
    }

    fn triangle(&mut self, [a, b, c]: [V3; 3], color: V3) {
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
                self.set(at.x as usize, at.y as usize, at.z + 1.0, MOVING * 0.8);
            }
        }
    }

    fn set(&mut self, column: usize, row: usize, near: f64, color: V3) {
        let index = row * self.size + column;
        if near > self.depth[index] {
            self.depth[index] = near;
            self.pixels[index] = [color.x as u8, color.y as u8, color.z as u8];
        }
    }
}

/// Right, up and towards the eye.
fn axes() -> [V3; 3] {
    let near = V3::new(0.45, -1.0, 0.5).normalize();
    let right = V3::z().cross(&near).normalize();
    [right, near.cross(&right), near]
}

fn encode(pixels: &[[u8; 3]], width: usize, height: usize) -> Vec<u8> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    // Writing into memory does not fail.
    if let Ok(mut writer) = encoder.write_header() {
        _ = writer.write_image_data(pixels.as_flattened());
        _ = writer.finish();
    }
    bytes
}
