//! Pictures of a field in a plane, as PNG: shades by value, contour lines, bricks, points and lines.

use std::io;
use std::path::Path;

use anyhow::Result;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Sdf};
use sdf_formats::atomic_write;

use crate::mesh_input::with_path;

/// A plane perpendicular to an axis, seen against the axis' direction: the other two axes point right and up.
pub struct Plane {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    pub at: f64,
    /// The box whose section is drawn.
    pub window: Aabb,
}

impl Plane {
    /// The axes that point right and up.
    fn across(&self) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][self.axis]
    }
}

/// An RGB picture of a plane, by rows from the top.
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
    plane: Plane,
    /// Length of a pixel's side.
    pixel: f64,
}

const SURFACE: [u8; 3] = [0, 0, 0];
const BAND: [u8; 3] = [24, 128, 72];
const BRICK_EDGE: [u8; 3] = [120, 120, 120];
const INSIDE: [[f64; 3]; 2] = [[198.0, 222.0, 241.0], [33.0, 92.0, 152.0]];
const OUTSIDE: [[f64; 3]; 2] = [[253.0, 236.0, 214.0], [214.0, 118.0, 40.0]];

impl Picture {
    /// Draws the field's values in a plane as shades, with contour lines at equal steps. The longer side has `longer`
    /// pixels. The ends of a `band`, |φ| = band, are lines too.
    pub fn new<F: Sdf>(field: &F, plane: Plane, longer: u32, band: Option<f64>) -> Self {
        let [right, up] = plane.across();
        let extents = plane.window.extents();
        let pixel = extents[right].max(extents[up]) / f64::from(longer);
        let [width, height] = [right, up].map(|axis| ((extents[axis] / pixel).ceil() as usize).max(1));
        let range = 0.5 * extents[right].min(extents[up]).max(pixel);
        let mut picture = Self { width, height, pixels: vec![[0; 3]; width * height], plane, pixel };
        for row in 0..height {
            for column in 0..width {
                let point = picture.point(column, row);
                let sample = field.sample(Vector3::from(point));
                // The in-plane gradient turns a value into a distance in pixels.
                let slope = sample.gradient[right].hypot(sample.gradient[up]);
                let color = shade(sample.value, slope, pixel, range);
                let slope = slope.max(FLAT);
                let off_band = band.map_or(f64::INFINITY, |band| (sample.value.abs() - band).abs() / (slope * pixel));
                picture.pixels[row * width + column] = ink(color, BAND, 1.5 - off_band);
            }
        }
        picture
    }

    fn point(&self, column: usize, row: usize) -> [f64; 3] {
        let [right, up] = self.plane.across();
        let mut point = [self.plane.at; 3];
        point[right] = self.plane.window.min[right] + (column as f64 + 0.5) * self.pixel;
        point[up] = self.plane.window.min[up] + ((self.height - row) as f64 - 0.5) * self.pixel;
        point
    }

    /// Column and row of a point projected along the axis; they may lie outside the picture.
    fn project(&self, point: [f64; 3]) -> [f64; 2] {
        let [right, up] = self.plane.across();
        let column = (point[right] - self.plane.window.min[right]) / self.pixel;
        [column, self.height as f64 - (point[up] - self.plane.window.min[up]) / self.pixel]
    }

    /// Outlines the bricks that the plane meets, and pales pixels outside of all bricks. `has_brick` takes the index of a
    /// brick slot along x, y and z; slots are cubes with this `side`, the first at `from`.
    pub fn bricks(&mut self, from: [f64; 3], side: f64, has_brick: impl Fn([u32; 3]) -> bool) {
        let across = self.plane.across();
        for row in 0..self.height {
            for column in 0..self.width {
                let point = self.point(column, row);
                let steps: [f64; 3] = std::array::from_fn(|axis| (point[axis] - from[axis]) / side);
                let slot = steps.map(|steps| steps as u32);
                let pixel = &mut self.pixels[row * self.width + column];
                if !has_brick(slot) {
                    *pixel = pixel.map(|part| 255 - (255 - part) / 3);
                }
                // An edge is drawn if the slot on either side has a brick.
                for axis in across {
                    let pixels_off = (steps[axis] - steps[axis].round()).abs() * side / self.pixel;
                    let mut neighbour = slot;
                    neighbour[axis] =
                        if steps[axis].fract() < 0.5 { slot[axis].saturating_sub(1) } else { slot[axis] + 1 };
                    if has_brick(slot) || has_brick(neighbour) {
                        *pixel = ink(*pixel, BRICK_EDGE, 1.0 - pixels_off);
                    }
                }
            }
        }
    }

    /// A filled circle with a white rim.
    pub fn dot(&mut self, point: [f64; 3], radius: f64, color: [u8; 3]) {
        let center = self.project(point);
        self.paint(center, radius + 1.5, |distance, _| if distance <= radius { Some(color) } else { Some([255; 3]) });
    }

    /// A line from one point to another.
    pub fn line(&mut self, from: [f64; 3], to: [f64; 3], radius: f64, color: [u8; 3]) {
        let [[x0, y0], [x1, y1]] = [self.project(from), self.project(to)];
        let steps = ((x1 - x0).hypot(y1 - y0) * 2.0).ceil().clamp(1.0, 1e5) as usize;
        for step in 0..=steps {
            let t = step as f64 / steps as f64;
            let center = [x0 + (x1 - x0) * t, y0 + (y1 - y0) * t];
            self.paint(center, radius, |_, _| Some(color));
        }
    }

    fn paint(&mut self, [x, y]: [f64; 2], radius: f64, color: impl Fn(f64, [u8; 3]) -> Option<[u8; 3]>) {
        let span = |center: f64, end: usize| {
            let clamp = |x: f64| x.clamp(0.0, end as f64) as usize;
            clamp(center - radius)..clamp(center + radius + 1.0)
        };
        for row in span(y, self.height) {
            for column in span(x, self.width) {
                let distance = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y);
                let pixel = &mut self.pixels[row * self.width + column];
                if distance <= radius {
                    *pixel = color(distance, *pixel).unwrap_or(*pixel);
                }
            }
        }
    }

    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        let written = atomic_write(path, |temporary| std::fs::write(temporary, self.png()?));
        with_path(path, written)
    }

    /// The bytes of a PNG file.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let other = |error: png::EncodingError| io::Error::other(error.to_string());
        let mut writer = encoder.write_header().map_err(other)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(other)?;
        writer.finish().map_err(other)?;
        Ok(bytes)
    }
}

/// In-plane slope below which no contour lines are drawn.
const FLAT: f64 = 0.1;

/// Colour of a value: a shade, darkened on twenty contour lines over `range`; the surface is a thick line.
fn shade(value: f64, slope: f64, pixel: f64, range: f64) -> [u8; 3] {
    // A flat region at a contour's value is not filled with the line's colour.
    let is_flat = slope < FLAT;
    let slope = slope.max(FLAT);
    let pixels_off = value.abs() / (slope * pixel);
    let [near, far] = if value < 0.0 { INSIDE } else { OUTSIDE };
    let depth = (value.abs() / range).min(1.0).sqrt();
    let step = range / 20.0;
    let off_line = (value / step - (value / step).round()).abs() * step / (slope * pixel);
    let line = if off_line < 0.6 && !is_flat { 0.88 } else { 1.0 };
    let color: [f64; 3] = std::array::from_fn(|k| (near[k] + (far[k] - near[k]) * depth) * line);
    ink(color.map(|part| part as u8), SURFACE, 2.0 - pixels_off)
}

/// Blends a line's colour over another: lines fade over a pixel.
fn ink(under: [u8; 3], line: [u8; 3], alpha: f64) -> [u8; 3] {
    let alpha = alpha.clamp(0.0, 1.0);
    std::array::from_fn(|k| (f64::from(under[k]) + (f64::from(line[k]) - f64::from(under[k])) * alpha) as u8)
}
