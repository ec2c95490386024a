//! What a picture shows beside or instead of a plain checkerboard.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::calib::{
    circles,
    detect::{Detection, Grid},
    image::Gray,
    marker::{self, Sighting},
};

/// Marks and circles, whatever the board.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// Square markers, where there are at least two.
    pub markers: Option<Sighting>,
    /// A grid of circles.
    pub circles: Option<circles::Grid>,
}

/// Share of the contrast between black and white squares that the inside of a plain square may vary by.
const PLAIN: f64 = 0.25;
/// Share of the picture from which a grid is what was photographed…
const LARGE: f64 = 0.04;
/// …or it has more corners than the pattern inside of a marker of 7 × 7 cells.
const MANY: usize = 36;
/// Share of the squares that may vary more: something lies on the board.
const FEW: f64 = 0.3;

impl Other {
    /// Looks for it where the checkerboard leaves a doubt: none was found, or its squares are not plain.
    pub fn beside(picture: &Gray, detection: &Detection) -> Self {
        if detection.grid.as_ref().is_some_and(|grid| is_large(picture, grid) && is_plain(picture, grid)) {
            return Self::default();
        }
        let sighting = marker::find(picture);
        if sighting.marks.len() >= 2 {
            return Self { markers: Some(sighting), circles: None };
        }
        let circles = if detection.grid.is_none() { circles::detect(picture).grid } else { None };
        Self { markers: None, circles }
    }

    /// Whether there is nothing.
    pub const fn is_none(&self) -> bool {
        self.markers.is_none() && self.circles.is_none()
    }
}

/// Whether a grid is what was photographed, and not a pattern in a marker: it has many corners or takes much of the picture.
fn is_large(picture: &Gray, grid: &Grid) -> bool {
    if grid.corners.len() > MANY {
        return true;
    }
    let px = || grid.corners.iter().map(|c| c.px);
    let (Some(low), Some(high)) = (px().reduce(|a, b| a.inf(&b)), px().reduce(|a, b| a.sup(&b))) else {
        return false;
    };
    let [w, h] = picture.size();
    (high - low).product() > LARGE * (w * h) as f64
}

/// Whether the squares of a grid are of one brightness each.
fn is_plain(picture: &Gray, grid: &Grid) -> bool {
    let at = |cell: [u32; 2]| grid.corners.iter().find(|c| c.cell == cell).map(|c| c.px);
    let value = |p: Vector2<f64>| {
        let [w, h] = picture.size();
        let (x, y) = (p.x.round().max(0.0) as usize, p.y.round().max(0.0) as usize);
        (x < w && y < h).then(|| match picture {
            Gray::U8(p) => f64::from(p.at(x, y)),
            Gray::U16(p) => f64::from(p.at(x, y)),
        })
    };
    // Mean and spread over the middle of each square, by colour.
    let (mut means, mut spreads) = ([(0.0, 0usize); 2], Vec::new());
    for corner in &grid.corners {
        let [c, r] = corner.cell;
        let (Some(a), Some(b), Some(d)) = (at([c + 1, r]), at([c, r + 1]), at([c + 1, r + 1])) else {
            continue;
        };
        let mut samples = Vec::with_capacity(25);
        for i in 0..5 {
            for j in 0..5 {
                let [u, v] = [i, j].map(|k| 0.2 + 0.15 * f64::from(k));
                let p = corner.px * ((1.0 - u) * (1.0 - v))
                    + a * (u * (1.0 - v))
                    + b * ((1.0 - u) * v)
                    + d * (u * v);
                samples.extend(value(p));
            }
        }
        if samples.len() < 25 {
            continue;
        }
        let mean = samples.iter().sum::<f64>() / 25.0;
        let spread = (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 25.0).sqrt();
        let colour = &mut means[((c + r) % 2) as usize];
        *colour = (colour.0 + mean, colour.1 + 1);
        spreads.push(spread);
    }
    let [a, b] = means.map(|(sum, n)| sum / n.max(1) as f64);
    let uneven = spreads.iter().filter(|s| **s > PLAIN * (a - b).abs()).count();
    (uneven as f64) < FEW * spreads.len() as f64
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        calib::{detect, synth::Scene},
        job::{Source, photo::Colours},
    };

    #[test]
    fn a_checkerboard_is_plain_and_costs_no_further_look() {
        let source = Source::View { scene: Arc::new(Scene::seed()), view: 0 };
        let picture = source.read(Colours::Gray).unwrap().photo.into_gray();
        let detection = detect::detect(&picture, &detect::Options::default());
        assert!(is_plain(&picture, detection.grid.as_ref().unwrap()));
        assert!(Other::beside(&picture, &detection).is_none());
    }
}
