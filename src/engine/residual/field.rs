//! The displacement itself: two numbers at each knot, smooth between them.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    bspline::{FEWEST, Patch},
};

/// Share of the knots around a place, by their weights, that data must support.
pub(super) const KNOWN: f64 = 0.95;
/// Most knots in a direction that are read from a file.
const MOST: usize = 4096;

/// A smooth displacement over a picture: bicubic B-splines, px.
///
/// Where the model of the camera shows a point at `px`, it is seen at `px + at(px)`. Beyond the grid the value of its border holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Wire", into = "Wire")]
pub struct Field {
    origin_px: [f64; 2],
    step_px: [f64; 2],
    knots: [usize; 2],
    offsets_px: Vec<[f64; 2]>,
}

/// As in files; checked on the way in.
#[derive(Clone, Serialize, Deserialize)]
struct Wire {
    origin_px: [f64; 2],
    step_px: [f64; 2],
    knots: [usize; 2],
    offsets_px: Vec<[f64; 2]>,
}

impl TryFrom<Wire> for Field {
    type Error = Error;

    fn try_from(w: Wire) -> Result<Self> {
        Self::new(w.origin_px, w.step_px, w.knots, w.offsets_px)
    }
}

impl From<Field> for Wire {
    fn from(f: Field) -> Self {
        Self { origin_px: f.origin_px, step_px: f.step_px, knots: f.knots, offsets_px: f.offsets_px }
    }
}

impl Field {
    /// From the place of the second knot of the second row (where the surface begins), the distances between columns and between
    /// rows, the numbers of columns and rows, and the value of each knot, row by row; all in px.
    ///
    /// # Errors
    /// [`Error::Invalid`] with what is wrong.
    pub fn new(
        origin_px: [f64; 2],
        step_px: [f64; 2],
        knots: [usize; 2],
        offsets_px: Vec<[f64; 2]>,
    ) -> Result<Self> {
        let refuse = |what: String| Err(Error::Invalid(format!("residual map: {what}")));
        if knots.iter().any(|n| !(FEWEST..=MOST).contains(n)) {
            return refuse(format!(
                "{knots:?} knots: from {FEWEST} to {MOST} in each direction are possible"
            ));
        }
        if offsets_px.len() != knots[0] * knots[1] {
            return refuse(format!(
                "{} offsets for {} x {} knots: give one for each knot, row by row",
                offsets_px.len(),
                knots[0],
                knots[1]
            ));
        }
        if !step_px.iter().all(|s| s.is_finite() && *s > 0.0) {
            return refuse(format!("a step of {step_px:?} px: it must be greater than zero"));
        }
        let mut numbers = origin_px.iter().chain(offsets_px.iter().flatten());
        if let Some(bad) = numbers.find(|v| !v.is_finite()) {
            return refuse(format!("{bad} is among its numbers: each must be finite"));
        }
        Ok(Self { origin_px, step_px, knots, offsets_px })
    }

    /// Columns and rows of knots.
    pub const fn knots(&self) -> [usize; 2] {
        self.knots
    }

    /// The sixteen knots around a place of the picture.
    pub(super) fn patch(&self, px: &Vector2<f64>) -> Patch {
        let index = [0, 1].map(|k| 1.0 + (px[k] - self.origin_px[k]) / self.step_px[k]);
        Patch::new(index, self.knots)
    }

    /// The displacement where the model shows a point, px.
    pub fn at(&self, px: &Vector2<f64>) -> Vector2<f64> {
        self.patch(px).value(&self.offsets_px).into()
    }

    /// Where a point is seen that the model shows at `px`.
    pub fn seen(&self, px: &Vector2<f64>) -> Vector2<f64> {
        px + self.at(px)
    }

    /// Inverse of [`Field::seen`]: where the model shows what is seen at `px`; `None` where the field folds.
    pub fn modelled(&self, px: &Vector2<f64>) -> Option<Vector2<f64>> {
        // A field is far flatter than 1 px a px: each round gains as many digits as its slope has zeros.
        let mut at = *px;
        for _ in 0..60 {
            let next = px - self.at(&at);
            let step = (next - at).norm();
            at = next;
            if step <= 1e-12 * (1.0 + px.norm()) {
                return Some(at);
            }
        }
        None
    }

    /// Whether corners say what the displacement is there; elsewhere it fades to zero.
    pub fn supports(&self, px: &Vector2<f64>) -> bool {
        // Knots without data are zero to the last bit, and no others are.
        let known = |at: usize| self.offsets_px.get(at).is_some_and(|o| *o != [0.0; 2]);
        self.patch(px).parts().iter().filter(|p| known(p.at)).map(|p| p.weight).sum::<f64>() > KNOWN
    }

    /// Largest displacement at a knot, px; nowhere is it larger.
    pub fn largest_px(&self) -> f64 {
        self.offsets_px.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max)
    }

    /// That of the same pictures resized by `scale`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a factor that is not greater than zero.
    pub fn scaled(&self, scale: f64) -> Result<Self> {
        Self::new(
            self.origin_px.map(|o| scale * (o + 0.5) - 0.5),
            self.step_px.map(|s| scale * s),
            self.knots,
            self.offsets_px.iter().map(|o| o.map(|v| scale * v)).collect(),
        )
    }

    /// That of the same pictures cut at `[x, y]`, px of the original.
    #[must_use]
    pub fn cropped(&self, [x, y]: [f64; 2]) -> Self {
        Self { origin_px: [self.origin_px[0] - x, self.origin_px[1] - y], ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 6 × 5 knots over 300 × 200 px with a bump.
    fn bump() -> Field {
        let mut offsets = vec![[0.0; 2]; 30];
        offsets[14] = [1.5, -0.6];
        offsets[15] = [0.4, 0.2];
        Field::new([-0.5, -0.5], [100.0, 100.0], [6, 5], offsets).unwrap()
    }

    #[test]
    fn what_is_seen_comes_back_to_the_model() {
        let field = bump();
        for (x, y) in (0..120).map(|k| (f64::from(k % 12) * 25.0, f64::from(k / 12) * 20.0)) {
            let px = Vector2::new(x, y);
            let back = field.modelled(&field.seen(&px)).unwrap();
            assert!((back - px).norm() < 1e-10, "{px}: {:e}", (back - px).norm());
        }
        assert!(field.at(&Vector2::new(120.0, 99.0)).norm() > 0.5);
        assert!(field.at(&Vector2::new(100.0, 100.0)).norm() <= field.largest_px());
    }

    #[test]
    fn resized_and_cut_pictures_keep_it() {
        let (field, px) = (bump(), Vector2::new(140.0, 90.0));
        let half = field.scaled(0.5).unwrap();
        let there = Vector2::new(0.5 * (px.x + 0.5) - 0.5, 0.5 * (px.y + 0.5) - 0.5);
        assert!((half.at(&there) - field.at(&px) * 0.5).norm() < 1e-14);
        let cut = field.cropped([30.0, 20.0]);
        assert!((cut.at(&(px - Vector2::new(30.0, 20.0))) - field.at(&px)).norm() < 1e-14);
        assert!(field.scaled(0.0).is_err() && field.scaled(f64::NAN).is_err());
    }

    #[test]
    fn files_that_contradict_themselves_are_refused() {
        let text = serde_json::to_string(&bump()).unwrap();
        assert_eq!(serde_json::from_str::<Field>(&text).unwrap(), bump());
        for (what, instead) in [
            ("\"knots\":[6,5]", "\"knots\":[6,6]"),
            ("\"knots\":[6,5]", "\"knots\":[3,10]"),
            ("\"step_px\":[100.0,", "\"step_px\":[0.0,"),
            ("\"step_px\":[100.0,", "\"step_px\":[1e999,"),
        ] {
            let broken = text.replace(what, instead);
            assert!(broken != text && serde_json::from_str::<Field>(&broken).is_err(), "{instead}");
        }
    }

    #[test]
    fn a_field_that_folds_has_no_inverse_there() {
        let mut offsets = vec![[0.0; 2]; 30];
        offsets[14] = [900.0, 0.0];
        let field = Field::new([-0.5, -0.5], [100.0, 100.0], [6, 5], offsets).unwrap();
        let there: Vec<_> = (0..30).map(|x| Vector2::new(f64::from(x) * 10.0, 99.5)).collect();
        assert!(there.iter().any(|px| field.modelled(px).is_none()));
        for px in there {
            if let Some(at) = field.modelled(&px) {
                assert!((field.seen(&at) - px).norm() < 1e-9);
            }
        }
    }
}
