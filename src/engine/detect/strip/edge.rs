//! One edge of a corner as a parabola across the pixel rows.

use super::profile::{Profile, pixel_variance};

/// An edge `u = o + p v + k v²/2` in pixels relative to a whole pixel near the corner.
///
/// A steep edge has `(u, v) = (x, y)`, a flat one `(y, x)`, so that |p| is at most about 1 and no angle is needed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Edge {
    pub(super) steep: bool,
    pub(super) o: f32,
    pub(super) p: f32,
    pub(super) k: f32,
    /// Gaussian blur along u, px, without the pixel.
    pub(super) s: f32,
    /// Profile for `s` and `p`, see [`Edge::set_profile`].
    pub(super) profile: Profile,
}

/// `x = u·by_u + v·by_v + at_zero`: the distance from an edge in units of its profile, to first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Form {
    pub(super) by_u: f32,
    pub(super) by_v: f32,
    pub(super) at_zero: f32,
}

impl Form {
    pub(super) fn at(&self, u: f32, v: f32) -> f32 {
        self.by_u * u + (self.by_v * v + self.at_zero)
    }
}

impl Edge {
    /// The straight edge through `at` with the direction `along`; it needs a direction.
    pub(super) fn through(at: [f64; 2], along: [f64; 2]) -> Self {
        let steep = along[1].abs() >= along[0].abs();
        let (p, o) = if steep {
            let p = along[0] / along[1];
            (p, at[0] - p * at[1])
        } else {
            let p = along[1] / along[0];
            (p, at[1] - p * at[0])
        };
        Self { steep, o: o as f32, p: p as f32, ..Self::default() }
    }

    /// Fits the profile to the present blur and slope.
    pub(super) fn set_profile(&mut self) {
        self.profile = Profile::new(self.s, self.p);
    }

    /// u on the edge in row v.
    pub(super) fn u(&self, v: f32) -> f32 {
        self.o + (self.p + 0.5 * self.k * v) * v
    }

    /// Width of the profile along u, px, with the pixel.
    pub(super) fn sd(&self) -> f32 {
        (self.s * self.s + pixel_variance(self.p)).sqrt()
    }

    /// Cosine between the normal and the u axis.
    pub(super) fn cos(&self) -> f32 {
        1.0 / (1.0 + self.p * self.p).sqrt()
    }

    /// Distance from this edge (without its curvature) in the (u, v) of a steep or a flat strip.
    pub(super) fn form(&self, steep: bool) -> Form {
        let q = 1.0 / self.profile.h;
        let (across, along, at_zero) = (q, -self.p * q, -self.o * q);
        if steep == self.steep {
            Form { by_u: across, by_v: along, at_zero }
        } else {
            Form { by_u: along, by_v: across, at_zero }
        }
    }

    /// Factor R of the second term `R P1' P2'` of the model: the first term of Mehler's series for a bivariate normal
    /// distribution whose correlation is the cosine between both normals.
    pub(super) fn skew(&self, other: &Self) -> f32 {
        let dot = if self.steep == other.steep { 1.0 + self.p * other.p } else { -self.p - other.p };
        dot * self.cos() * other.cos() * self.sd() * other.sd() / (self.profile.h * other.profile.h)
    }
}
