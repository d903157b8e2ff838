use std::path::Path;

use anyhow::Result;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Sdf};
use sdf_formats::atomic_write;

use crate::mesh_input::at;

/// A plane across an axis, seen from its far end: the other two axes run to the right and up.
pub struct Plane {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    pub at: f64,
    /// What of the field's space is seen.
    pub window: Aabb,
}

impl Plane {
    /// The axes that run to the right and up.
    fn across(&self) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][self.axis]
    }
}

/// A picture under way, by rows from the top.
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
    /// The field's values in a plane, in shades with a line at equal steps; `longer` pixels along the longer side. Where a
    /// `band` is given, lines stand where it ends.
    pub fn of<F: Sdf>(field: &F, plane: Plane, longer: u32, band: Option<f64>) -> Self {
        let [right, up] = plane.across();
        let extents = plane.window.extents();
        let pixel = extents[right].max(extents[up]) / f64::from(longer);
        let [width, height] = [right, up].map(|axis| ((extents[axis] / pixel).ceil() as usize).max(1));
        let reach = 0.5 * extents[right].min(extents[up]).max(pixel);
        let mut picture = Self { width, height, pixels: vec![[0; 3]; width * height], plane, pixel };
        for row in 0..height {
            for column in 0..width {
                let point = picture.point(column, row);
                let sample = field.sample(Vector3::from(point));
                // The gradient's part in the plane says how far away the surface's line is drawn.
                let slope = sample.gradient[right].hypot(sample.gradient[up]);
                let color = shade(sample.value, slope, pixel, reach);
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

    /// Column and row of a point, seen along the axis; they may lie outside the picture.
    fn place(&self, point: [f64; 3]) -> [f64; 2] {
        let [right, up] = self.plane.across();
        let column = (point[right] - self.plane.window.min[right]) / self.pixel;
        [column, self.height as f64 - (point[up] - self.plane.window.min[up]) / self.pixel]
    }

    /// Outlines the bricks that the plane passes, and pales what lies in none. `has_brick` is asked at places along x, y
    /// and z, which begin at a point and have sides of one length.
    pub fn bricks(&mut self, from: [f64; 3], side: f64, has_brick: impl Fn([u32; 3]) -> bool) {
        let across = self.plane.across();
        for row in 0..self.height {
            for column in 0..self.width {
                let steps = self.point(column, row);
                let steps: [f64; 3] = std::array::from_fn(|axis| (steps[axis] - from[axis]) / side);
                let place = steps.map(|steps| steps as u32);
                let pixel = &mut self.pixels[row * self.width + column];
                if !has_brick(place) {
                    *pixel = pixel.map(|part| 255 - (255 - part) / 3);
                }
                // Whose edge it is does not matter: one to the left or below that has a brick draws it too.
                for axis in across {
                    let pixels_off = (steps[axis] - steps[axis].round()).abs() * side / self.pixel;
                    let mut beyond = place;
                    beyond[axis] =
                        if steps[axis].fract() < 0.5 { place[axis].saturating_sub(1) } else { place[axis] + 1 };
                    if has_brick(place) || has_brick(beyond) {
                        *pixel = ink(*pixel, BRICK_EDGE, 1.0 - pixels_off);
                    }
                }
            }
        }
    }

    /// A filled circle with a white rim.
    pub fn dot(&mut self, point: [f64; 3], radius: f64, color: [u8; 3]) {
        let center = self.place(point);
        self.paint(center, radius + 1.5, |distance, _| if distance <= radius { Some(color) } else { Some([255; 3]) });
    }

    /// A line from one point to another.
    pub fn line(&mut self, from: [f64; 3], to: [f64; 3], radius: f64, color: [u8; 3]) {
        let [[x0, y0], [x1, y1]] = [self.place(from), self.place(to)];
        let steps = ((x1 - x0).hypot(y1 - y0) * 2.0).ceil().clamp(1.0, 1e5) as usize;
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let center = [x0 + (x1 - x0) * share, y0 + (y1 - y0) * share];
            self.paint(center, radius, |_, _| Some(color));
        }
    }

    fn paint(&mut self, [x, y]: [f64; 2], radius: f64, color: impl Fn(f64, [u8; 3]) -> Option<[u8; 3]>) {
        let span = |center: f64, most: usize| {
            let clamp = |x: f64| x.clamp(0.0, most as f64) as usize;
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
        let written = atomic_write(path, |temporary| {
            let file = std::io::BufWriter::new(std::fs::File::create(temporary)?);
            let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            let other = |error: png::EncodingError| std::io::Error::other(error.to_string());
            let mut writer = encoder.write_header().map_err(other)?;
            writer.write_image_data(self.pixels.as_flattened()).map_err(other)?;
            writer.finish().map_err(other)
        });
        at(path, written)
    }
}

/// A slope within the plane below which lines of equal distance have no place.
const FLAT: f64 = 0.1;

/// Twenty lines of equal distance over `reach`, and the surface thick.
fn shade(value: f64, slope: f64, pixel: f64, reach: f64) -> [u8; 3] {
    // Where nothing changes, no line runs, even if the value is that of one.
    let is_flat = slope < FLAT;
    let slope = slope.max(FLAT);
    let pixels_off = value.abs() / (slope * pixel);
    let [near, far] = if value < 0.0 { INSIDE } else { OUTSIDE };
    let depth = (value.abs() / reach).min(1.0).sqrt();
    let step = reach / 20.0;
    let off_line = (value / step - (value / step).round()).abs() * step / (slope * pixel);
    let line = if off_line < 0.6 && !is_flat { 0.88 } else { 1.0 };
    let color: [f64; 3] = std::array::from_fn(|k| (near[k] + (far[k] - near[k]) * depth) * line);
    ink(color.map(|part| part as u8), SURFACE, 2.0 - pixels_off)
}

/// A line's color over another, so much of it: lines fade over a pixel.
fn ink(under: [u8; 3], line: [u8; 3], share: f64) -> [u8; 3] {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|k| (f64::from(under[k]) + (f64::from(line[k]) - f64::from(under[k])) * share) as u8)
}
