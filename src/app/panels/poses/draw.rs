//! Projection of the scene to the screen, far things first.

use egui::{Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2};
use nalgebra::{Point3, Vector3};

use super::scene::Scene;
use crate::{
    app::{screen::Orbit, style::Tokens},
    calib::{observation::FrameId, order},
};

/// Eye to middle, in radii: far enough that lines stay calm.
const EYE: f64 = 4.0;

/// Outlines on the screen, far to near.
pub(super) struct Drawn(Vec<(FrameId, Vec<Pos2>)>);

impl Drawn {
    /// The nearest thing at a point.
    pub(super) fn at(&self, point: Pos2) -> Option<FrameId> {
        self.0.iter().rev().find(|(_, outline)| inside(outline, point)).map(|(id, _)| *id)
    }
}

fn inside(outline: &[Pos2], p: Pos2) -> bool {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges
        .filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
        .count()
        % 2
        == 1
}

/// The camera that looks at the scene: y points down as in pictures.
struct Eye {
    rect: Rect,
    center: Point3<f64>,
    scale: f64,
    yaw: f64,
    pitch: f64,
    radius: f64,
    /// Of the whole picture, so that what is seen stands in the middle.
    shift: Vec2,
}

impl Eye {
    /// Chooses scale and shift so that everything is seen, and `zoom` times as large.
    fn fit(&mut self, scene: &Scene, zoom: f64) {
        let outlines = scene.boards.iter().flat_map(|b| &b.outline);
        let points = outlines.chain(scene.middle.iter().flatten()).chain(scene.tips.iter().flatten());
        let mut bounds = Rect::NOTHING;
        self.scale = 100.0;
        for p in points {
            bounds.extend_with(self.see(p).0);
        }
        if bounds.is_positive() {
            let room = self.rect.shrink2(self.rect.size() * 0.04).size() / bounds.size();
            let factor = f64::from(room.x.min(room.y)) * zoom;
            self.scale *= factor;
            self.shift = (self.rect.center() - bounds.center()) * factor as f32;
        }
    }

    /// Place on the screen and depth.
    fn see(&self, p: &Point3<f64>) -> (Pos2, f64) {
        let d = (p - self.center) / self.radius;
        let (s, c) = self.yaw.sin_cos();
        let turned = Vector3::new(c * d.x + s * d.z, d.y, -s * d.x + c * d.z);
        let (s, c) = self.pitch.sin_cos();
        let seen = Vector3::new(turned.x, c * turned.y - s * turned.z, s * turned.y + c * turned.z);
        let depth = EYE + seen.z;
        let k = self.scale * EYE / depth.max(0.2);
        let middle = self.rect.center() + self.shift;
        (pos2(middle.x + (seen.x * k) as f32, middle.y + (seen.y * k) as f32), depth)
    }
}

/// Draws the scene into a rectangle.
pub(super) fn show(
    painter: &Painter,
    t: &Tokens,
    scene: &Scene,
    rect: Rect,
    orbit: &Orbit,
    selected: Option<FrameId>,
) -> Drawn {
    let (center, radius) = scene.sphere;
    let mut eye =
        Eye { rect, center, radius, scale: 1.0, yaw: orbit.yaw, pitch: orbit.pitch, shift: Vec2::ZERO };
    eye.fit(scene, orbit.zoom);
    floor(painter, t, scene, &eye);
    let mut things: Vec<(f64, usize)> = scene
        .boards
        .iter()
        .enumerate()
        .map(|(i, b)| (b.outline.iter().map(|p| eye.see(p).1).sum::<f64>() / b.outline.len() as f64, i))
        .collect();
    // The selected one is drawn last: nothing hides it.
    let chosen = |i: usize| selected == Some(scene.boards[i].id);
    order::by(&mut things, |(far, i)| [f64::from(chosen(*i)), -far]);
    let mut drawn = Vec::new();
    for (_, i) in things {
        let thing = &scene.boards[i];
        let outline: Vec<Pos2> = thing.outline.iter().map(|p| eye.see(p).0).collect();
        let chosen = selected == Some(thing.id);
        let (line, fill, width) = if chosen {
            (t.accent, t.accent.gamma_multiply(0.28), 1.8)
        } else {
            (t.bar2, t.bar2.gamma_multiply(0.07), 1.0)
        };
        if let Some(tip) = scene.tips.get(i).copied().flatten() {
            let tip = eye.see(&tip).0;
            for corner in &outline {
                painter.line_segment([tip, *corner], Stroke::new(width * 0.7, line));
            }
        }
        painter.add(Shape::convex_polygon(outline.clone(), fill, Stroke::NONE));
        painter.add(Shape::closed_line(outline.clone(), Stroke::new(width, line)));
        if scene.tips.is_empty() {
            painter.circle_filled(outline[0], if chosen { 3.0 } else { 1.6 }, line);
        }
        drawn.push((thing.id, outline));
    }
    for [a, b] in &scene.middle {
        painter.line_segment([eye.see(a).0, eye.see(b).0], Stroke::new(1.4, t.ink));
    }
    Drawn(drawn)
}

/// A grid below everything.
fn floor(painter: &Painter, t: &Tokens, scene: &Scene, eye: &Eye) {
    let (center, radius) = scene.sphere;
    let n = (radius / scene.floor_step).ceil() as i32;
    let reach = f64::from(n) * scene.floor_step;
    for k in -n..=n {
        let d = f64::from(k) * scene.floor_step;
        let at = |x: f64, z: f64| Point3::new(center.x + x, scene.floor_y, center.z + z);
        for [a, b] in [[at(-reach, d), at(reach, d)], [at(d, -reach), at(d, reach)]] {
            painter.line_segment([eye.see(&a).0, eye.see(&b).0], Stroke::new(1.0, t.line));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_in_polygons() {
        let square = [pos2(0.0, 0.0), pos2(2.0, 0.0), pos2(2.0, 2.0), pos2(0.0, 2.0)];
        assert!(inside(&square, pos2(1.0, 1.5)) && !inside(&square, pos2(3.0, 1.0)));
    }
}
