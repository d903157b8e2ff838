//! The part of an element that lies in a tetrahedron: convex, cut by four half-spaces (Sutherland and Hodgman 1974, "Reentrant
//! polygon clipping"), in weights of the element.

/// Corners of a triangle that is cut by four planes.
const MAX_CORNERS: usize = 7;

/// A convex part of an element: weights of its corners. One corner of a vertex, two of an edge, three to seven of a face.
#[derive(Clone, Copy)]
pub(super) struct Part<const N: usize> {
    corners: [[f64; N]; MAX_CORNERS],
    count: usize,
}

impl<const N: usize> Part<N> {
    /// The part where all weights of a tetrahedron are at least `least`. `weights[k]` has those of the element's corner k.
    pub fn inside(weights: &[[f64; 4]; N], least: f64) -> Self {
        let mut part = Self { corners: [[0.0; N]; MAX_CORNERS], count: N.min(MAX_CORNERS) };
        for (k, corner) in part.corners.iter_mut().enumerate().take(N) {
            *corner = core::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        }
        for plane in 0..4 {
            part.cut(&weights.map(|weights| weights[plane] - least));
        }
        part
    }

    /// Keeps the points with Σ w_k `heights`_k ≥ 0.
    fn cut(&mut self, heights: &[f64; N]) {
        let before = *self;
        let height =
            |corner: &[f64; N]| corner.iter().zip(heights).map(|(weight, height)| weight * height).sum::<f64>();
        self.count = 0;
        let corners = before.corners.get(..before.count).unwrap_or(&[]);
        for (index, corner) in corners.iter().enumerate() {
            // An edge has one side, a face as many as corners.
            let is_side = if N == 3 { corners.len() > 1 } else { index > 0 };
            let previous = if index > 0 { corners.get(index.wrapping_sub(1)) } else { corners.last() };
            let here = height(corner);
            if let Some(previous) = previous.filter(|_| is_side) {
                let there = height(previous);
                if (here >= 0.0) != (there >= 0.0) {
                    let along = there / (there - here);
                    self.push(core::array::from_fn(|k| previous[k] + (corner[k] - previous[k]) * along));
                }
            }
            if here >= 0.0 {
                self.push(*corner);
            }
        }
    }

    fn push(&mut self, corner: [f64; N]) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count = self.count.saturating_add(1);
        }
    }

    /// The simplices that the part consists of: itself, or a fan of triangles.
    pub fn simplices(&self) -> impl Iterator<Item = [[f64; N]; N]> + '_ {
        let corners = self.corners.get(..self.count).unwrap_or(&[]);
        (0..corners.len().saturating_sub(N.saturating_sub(1))).map(move |fan| {
            core::array::from_fn(|k| {
                let index = if k == 0 { 0 } else { fan.saturating_add(k) };
                corners.get(index).copied().unwrap_or([0.0; N])
            })
        })
    }
}

/// The share of an element that a simplex of it takes, 0 to 1: length of an edge, area of a face, 1 of a vertex.
pub(super) fn share<const N: usize>(simplex: &[[f64; N]; N]) -> f64 {
    match N {
        2 => (simplex[1][1] - simplex[0][1]).abs(),
        3 => {
            let side = |k: usize, axis: usize| simplex[k][axis] - simplex[0][axis];
            (side(1, 1) * side(2, 2) - side(1, 2) * side(2, 1)).abs()
        }
        _ => 1.0,
    }
}
