//! The splined camera: a stereographic projection with two smooth surfaces of corrections, which follows any lens, fisheyes beyond
//! 180° included.
//!
//! A point `p` at the angle θ off the axis has the stereographic place `u = 2 tan(θ/2) · p_xy/|p_xy|`, and is seen at
//!
//! ```text
//! q = diag(fx, fy) (u + Δu(u)) + (cx, cy)
//! ```
//!
//! `Δu` is a grid of control points over `u`, bicubic B-splines between them ([`crate::bspline`]). `fx fy cx cy` say nothing that the
//! surfaces could not say, so they are held when a camera is fitted ([`fit()`]). Each control point moves a small part of the picture,
//! so the camera knows nothing where no corner was: [`Splined::supports`] says where.
//!
//! It is mrcal's `LENSMODEL_SPLINED_STEREOGRAPHIC` of order 3, number for number (D. Kogan, *mrcal*, "Lens models"): `Nx × Ny` control
//! points, evenly spaced, symmetric about the axis, one interval beyond the edge of the horizontal field of view `fov_x_deg` on either
//! side. Beyond the grid the value of its border holds.

mod fit;
mod follow;
mod pose;
mod seen;
mod stereographic;

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::{
    Error, Result,
    bspline::{FEWEST, Patch},
    camera::{LANES, Lanes, tangents},
    lens::Lens,
};
pub use fit::{Fitted, fit};
pub use pose::residuals_of;

/// Most control points of a camera.
const MOST: usize = 250_000;
/// Share of a place's control points, by their weights, that corners must have moved: those of a corner of a patch are few.
const KNOWN: f64 = 0.9;

/// How a splined camera is divided; mrcal's configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Columns and rows of control points.
    pub knots: [usize; 2],
    /// Horizontal field of view that they cover, degrees, below 360.
    pub fov_x_deg: u32,
}

impl Layout {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the number that is out of range.
    pub fn validate(&self) -> Result<()> {
        let [columns, rows] = self.knots;
        if columns < FEWEST || rows < FEWEST || columns.saturating_mul(rows) > MOST {
            return Err(Error::Invalid(format!(
                "{columns} x {rows} control points: at least {FEWEST} x {FEWEST} are needed, at most {MOST} in all are possible"
            )));
        }
        if !(1..360).contains(&self.fov_x_deg) {
            return Err(Error::Invalid(format!(
                "a horizontal field of view of {}°: give 1 to 359",
                self.fov_x_deg
            )));
        }
        Ok(())
    }

    /// Intervals between control points for one unit of `u`.
    fn per_u(&self) -> f64 {
        let edge = 2.0 * (0.25 * f64::from(self.fov_x_deg).to_radians()).tan();
        (self.knots[0] - 3) as f64 / (2.0 * edge)
    }

    /// Index coordinates of a stereographic place.
    fn index(&self, u: &Vector2<f64>) -> [f64; 2] {
        let per_u = self.per_u();
        [0, 1].map(|k| u[k] * per_u + (self.knots[k] - 1) as f64 * 0.5)
    }

    /// Whether a stereographic place lies on the grid.
    fn holds(&self, u: &Vector2<f64>) -> bool {
        const ROUNDING: f64 = 1e-9;
        let at = self.index(u);
        (0..2).all(|k| (1.0 - ROUNDING..=(self.knots[k] - 2) as f64 + ROUNDING).contains(&at[k]))
    }

    /// The control points around a stereographic place.
    fn patch(&self, u: &Vector2<f64>) -> Patch {
        Patch::new(self.index(u), self.knots)
    }
}

/// A splined camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Splined {
    size_px: [u32; 2],
    layout: Layout,
    /// `fx fy cx cy`, px.
    core: [f64; 4],
    /// Δu of each control point, row by row.
    surface: Vec<[f64; 2]>,
    /// Whether corners have moved it.
    known: Vec<bool>,
}

/// A projected point with what the fit needs of it.
#[derive(Clone, Debug)]
pub struct SplinedProjection {
    /// Where it appears, px.
    pub px: Vector2<f64>,
    /// ∂px / ∂point in the camera frame.
    pub by_point: Matrix2x3<f64>,
    /// The control points that move it: ∂u/∂Δu_x is `fx` times the weight, ∂v/∂Δu_y `fy` times it, the others are zero.
    pub patch: Patch,
}

impl Splined {
    /// From `[fx, fy, cx, cy]` (px) and Δu of each control point, row by row; all of them count as known.
    ///
    /// # Errors
    /// [`Error::Invalid`] with what is wrong.
    pub fn new(size_px: [u32; 2], layout: Layout, core: [f64; 4], surface: Vec<[f64; 2]>) -> Result<Self> {
        let camera = Self { size_px, layout, core, known: vec![true; surface.len()], surface };
        camera.validate()?;
        Ok(camera)
    }

    /// How it is divided.
    pub const fn layout(&self) -> Layout {
        self.layout
    }

    /// Δu of each control point, row by row.
    pub fn surface(&self) -> &[[f64; 2]] {
        &self.surface
    }

    /// Projects a point of the camera frame with all derivatives; `None` straight behind the camera.
    pub fn project(&self, point: &Vector3<f64>) -> Option<SplinedProjection> {
        let (u, u_by_point) = stereographic::project(point)?;
        let (px, by_u, patch) = self.show(&u);
        Some(SplinedProjection { px, by_point: by_u * u_by_point, patch })
    }

    /// Where a stereographic place is shown, px, with ∂px/∂u.
    fn show(&self, u: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>, Patch) {
        let [fx, fy, cx, cy] = self.core;
        let patch = self.layout.patch(u);
        let (mut moved, mut by) = (*u, Matrix2::zeros());
        for part in patch.parts() {
            let Some(delta) = self.surface.get(part.at).map(|d| Vector2::from(*d)) else { continue };
            moved += delta * part.weight;
            by += delta * Vector2::from(part.slope).transpose();
        }
        let by_u =
            Matrix2::from_diagonal(&Vector2::new(fx, fy)) * (Matrix2::identity() + by * self.layout.per_u());
        (Vector2::new(fx * moved.x + cx, fy * moved.y + cy), by_u, patch)
    }

    /// Unit ray of a pixel: Newton on the own Jacobian; `None` where there is none on the grid, or the surface folds there.
    pub fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        let [fx, fy, cx, cy] = self.core;
        let mut u = Vector2::new((px.x - cx) / fx, (px.y - cy) / fy);
        let (mut at, mut by, _) = self.show(&u);
        let mut miss = px - at;
        let enough = 1e-15 * (px.norm() + fx);
        for _ in 0..60 {
            if miss.norm() <= enough {
                break;
            }
            let mut step = by.try_inverse()? * miss;
            let mut better = None;
            for _ in 0..12 {
                let next = u + step;
                let (there, slope, _) = self.show(&next);
                if (px - there).norm() < miss.norm() {
                    better = Some((next, there, slope));
                    break;
                }
                step *= 0.5;
            }
            let Some((next, there, slope)) = better else { break };
            (u, at, by) = (next, there, slope);
            miss = px - at;
        }
        let found = miss.norm() <= 1e-9 * (px.norm() + fx) && by.determinant() > 0.0 && self.layout.holds(&u);
        found.then(|| stereographic::ray(&u))
    }

    /// Whether corners say where a ray of the camera frame is seen; elsewhere the camera is a guess.
    pub fn supports(&self, ray: &Vector3<f64>) -> bool {
        let Some((u, _)) = stereographic::project(ray) else { return false };
        let known = |at: usize| self.known.get(at) == Some(&true);
        let sum: f64 = self.layout.patch(&u).parts().iter().filter(|p| known(p.at)).map(|p| p.weight).sum();
        self.layout.holds(&u) && sum >= KNOWN
    }

    /// Share of the picture's pixels whose rays are supported, 0 to 1.
    pub fn supported_fraction(&self) -> f64 {
        const SAMPLES: u32 = 48;
        let [w, h] = self.size_px.map(f64::from);
        let at = |k: u32, n: f64| (f64::from(k) + 0.5) / f64::from(SAMPLES) * n - 0.5;
        let count = (0..SAMPLES * SAMPLES)
            .filter(|k| {
                let px = Vector2::new(at(k % SAMPLES, w), at(k / SAMPLES, h));
                self.unproject(&px).is_some_and(|ray| self.supports(&ray))
            })
            .count();
        count as f64 / f64::from(SAMPLES * SAMPLES)
    }

    /// Whether the surface turns back somewhere in what the picture shows: two rays would share a pixel.
    pub fn folds(&self) -> bool {
        /// Places in an interval between control points.
        const FINE: usize = 3;
        let [w, h] = self.size_px.map(f64::from);
        let (per_u, [columns, rows]) = (self.layout.per_u(), self.layout.knots);
        let place = |k: usize, n: usize| (1.0 + k as f64 / FINE as f64 - (n - 1) as f64 * 0.5) / per_u;
        (0..=FINE * (rows - 3)).any(|j| {
            (0..=FINE * (columns - 3)).any(|i| {
                let (px, by, _) = self.show(&Vector2::new(place(i, columns), place(j, rows)));
                let inside = px.x > -0.5 && px.y > -0.5 && px.x < w - 0.5 && px.y < h - 0.5;
                inside && by.determinant() <= 0.0
            })
        })
    }
}

impl Lens for Splined {
    fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    fn intrinsics(&self) -> [f64; 4] {
        self.core
    }

    fn validate(&self) -> Result<()> {
        self.layout.validate()?;
        let refuse = |what: String| Err(Error::Invalid(what));
        let [columns, rows] = self.layout.knots;
        if self.surface.len() != columns * rows || self.known.len() != self.surface.len() {
            return refuse(format!("{} values for {columns} x {rows} control points", self.surface.len()));
        }
        if let Some(bad) = self.core.iter().chain(self.surface.iter().flatten()).find(|v| !v.is_finite()) {
            return refuse(format!("{bad} is among the parameters: every one must be a finite number"));
        }
        if let Some(f) = self.core.iter().take(2).find(|f| **f <= 0.0) {
            return refuse(format!("a focal length of {f} px: it must be greater than zero"));
        }
        if self.size_px.contains(&0) {
            let [w, h] = self.size_px;
            return refuse(format!("a picture of {w} x {h} px is empty: give the size of the photographs"));
        }
        Ok(())
    }

    fn project_px(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (u, _) = stereographic::project(point)?;
        Some(self.show(&u).0)
    }

    fn project_px_batch(&self, points: &[Lanes; 3], out: &mut [Lanes; 2]) {
        for l in 0..LANES {
            let px = self.project_px(&Vector3::new(points[0][l], points[1][l], points[2][l]));
            (out[0][l], out[1][l]) = px.map_or((f64::NAN, f64::NAN), |px| (px.x, px.y));
        }
    }

    fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.unproject(px)
    }

    fn expansion(&self, ray: &Vector3<f64>) -> Option<f64> {
        let p = self.project(ray)?;
        let [e1, e2] = tangents(ray);
        let (a, b) = (p.by_point * e1, p.by_point * e2);
        Some(a.x * b.y - a.y * b.x)
    }

    fn shared(&self) -> Arc<dyn Lens> {
        Arc::new(self.clone())
    }
}

#[cfg(test)]
mod tests;
