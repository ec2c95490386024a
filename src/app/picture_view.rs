//! From pixels of a picture to points of the screen, and marks over pictures.

use egui::{Color32, Painter, Pos2, Rect, Stroke, Vec2, pos2, vec2};

use super::style::{CASING, DETECTED, PROJECTED, RESIDUAL};

/// Where a picture lies on the screen. Pixels have their origin at the centre of the first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The whole picture on the screen.
    pub rect: Rect,
    /// Points for one pixel.
    pub zoom: f64,
}

impl Place {
    /// All of the picture, as large as fits into `inside`.
    pub fn fitted(size_px: [u32; 2], inside: Rect) -> Self {
        let [w, h] = size_px.map(|n| f64::from(n.max(1)));
        let zoom = (f64::from(inside.width()) / w).min(f64::from(inside.height()) / h).max(1e-6);
        Self::around(size_px, inside, zoom, [(w - 1.0) / 2.0, (h - 1.0) / 2.0])
    }

    /// With a pixel in the middle of `inside`.
    pub fn around(size_px: [u32; 2], inside: Rect, zoom: f64, center_px: [f64; 2]) -> Self {
        let size = size_px.map(|n| f64::from(n) * zoom);
        let left = f64::from(inside.center().x) - (center_px[0] + 0.5) * zoom;
        let top = f64::from(inside.center().y) - (center_px[1] + 0.5) * zoom;
        let rect = Rect::from_min_size(pos2(left as f32, top as f32), vec2(size[0] as f32, size[1] as f32));
        Self { rect, zoom }
    }

    /// The picture over all of a rectangle of its shape.
    pub fn covering(rect: Rect, size_px: [u32; 2]) -> Self {
        Self { rect, zoom: f64::from(rect.width()) / f64::from(size_px[0].max(1)) }
    }

    /// The point of a pixel.
    pub fn point(&self, [x, y]: [f64; 2]) -> Pos2 {
        pos2(
            (f64::from(self.rect.left()) + (x + 0.5) * self.zoom) as f32,
            (f64::from(self.rect.top()) + (y + 0.5) * self.zoom) as f32,
        )
    }

    /// The pixel of a point.
    pub fn pixel(&self, at: Pos2) -> [f64; 2] {
        [
            f64::from(at.x - self.rect.left()) / self.zoom - 0.5,
            f64::from(at.y - self.rect.top()) / self.zoom - 0.5,
        ]
    }
}

/// A corner with what a calibration makes of it, on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    /// Where it was detected.
    pub detected: Pos2,
    /// Where it is projected, its distance drawn longer; none without a calibration.
    pub projected: Option<Pos2>,
}

/// Draws marks, casings below all of them; `scale` 1 is the size in a large picture.
pub fn marks(painter: &Painter, list: &[Mark], corners: bool, reprojected: bool, scale: f32) {
    let (r, arm) = (3.4 * scale, 2.4 * scale);
    let width = |w: f32| w * scale.max(0.7);
    let line = |a: Pos2, b: Pos2, w: f32, color: Color32| painter.line_segment([a, b], Stroke::new(w, color));
    let cross = |at: Pos2, w: f32, color: Color32| {
        let d = vec2(arm, arm);
        line(at - d, at + d, w, color);
        let d: Vec2 = vec2(arm, -arm);
        line(at - d, at + d, w, color);
    };
    for pass in [true, false] {
        let wider = if pass { 1.4 * scale } else { 0.0 };
        let paint = |color: Color32| if pass { CASING } else { color };
        for mark in list {
            if corners {
                painter.circle_stroke(mark.detected, r, Stroke::new(width(1.4) + wider, paint(DETECTED)));
            }
            if let (true, Some(projected)) = (reprojected, mark.projected) {
                line(mark.detected, projected, width(1.8) + wider, paint(RESIDUAL));
                cross(projected, width(1.5) + wider, paint(PROJECTED));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_pixel_has_its_centre_at_zero() {
        let inside = Rect::from_min_size(pos2(10.0, 20.0), vec2(640.0, 480.0));
        let place = Place::fitted([640, 480], inside);
        assert_eq!((place.zoom, place.point([0.0, 0.0])), (1.0, pos2(10.5, 20.5)));
        let place = Place::around([640, 480], inside, 8.0, [100.25, 50.0]);
        assert_eq!(place.point([100.25, 50.0]), inside.center());
        let [x, y] = place.pixel(place.point([3.0, 4.5]));
        assert!((x - 3.0).abs() < 1e-3 && (y - 4.5).abs() < 1e-3);
    }
}
