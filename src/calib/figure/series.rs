//! A quantity that is measured again and again, with its σ and the band that it should stay in.

use super::{
    axes::{Axes, Names},
    color,
    svg::Panel,
};

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// When, or at what.
    pub x: f64,
    /// The quantity.
    pub y: f64,
    /// Its σ; 0 where it has none.
    pub sigma: f64,
    /// Whether it is as it should be.
    pub good: bool,
}

/// Points with whiskers of 1σ, each over its band `[low, high]`.
pub fn series(points: &[Point], bands: &[[f64; 2]], title: &str, x_name: &str, y_name: &str) -> Panel {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let room = if high > low { 0.08 * (high - low) } else { 0.5 };
        if high >= low { [low - room, high + room] } else { [0.0, 1.0] }
    };
    let x = range(&mut points.iter().map(|p| p.x));
    let whiskers = points.iter().flat_map(|p| [p.y - p.sigma, p.y + p.sigma]);
    let y = range(&mut whiskers.chain(bands.iter().flatten().copied()));
    let names = Names { title, x: x_name, y: y_name, x_ticks: true };
    let (mut p, axes) = Axes::draw(400.0, 300.0, x, y, names);
    let half = 0.5 * axes.area[2] / points.len().max(1) as f64;
    let [left, _, width, _] = axes.area;
    for (point, [low, high]) in points.iter().zip(bands) {
        let ([at, top], [_, bottom]) = (axes.at(point.x, *high), axes.at(point.x, *low));
        let from = (at - half).max(left);
        let to = (at + half).min(left + width);
        if high > low {
            p.rect(from, top, to - from, bottom - top, color::GREEN, "fill-opacity=\"0.14\"");
        }
    }
    for point in points {
        let stroke = if point.good { color::BLUE } else { color::RED };
        if point.sigma > 0.0 {
            let [from, to] = [-1.0, 1.0].map(|k| axes.at(point.x, point.y + k * point.sigma));
            p.line(from, to, stroke, 1.5, "");
        }
        p.circle(axes.at(point.x, point.y), 4.0, &format!("fill=\"{stroke}\""));
    }
    p
}
