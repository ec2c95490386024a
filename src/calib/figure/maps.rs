//! Figures 6 and 8: coverage of the picture, and maps with colour bars.

use colorous::Gradient;
use nalgebra::Vector2;

use super::{
    axes::{Axes, label, ticks},
    color,
    svg::{Anchor, Panel, Type},
};

/// Longer side of a map on the page.
const SIDE: f64 = 340.0;

/// Numbers over a picture: cell `(i, j)` covers an equal share of its area; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Row by row.
    pub values: Vec<f64>,
}

/// How numbers become colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// From 0 or the smallest number to the largest, dark to bright.
    Sequential,
    /// The same, equal steps of colour for equal ratios; numbers that are not positive count as none.
    Logarithmic,
    /// Zero in the middle, pale.
    Diverging,
}

impl Scale {
    const fn gradient(self) -> Gradient {
        match self {
            Self::Sequential | Self::Logarithmic => colorous::VIRIDIS,
            Self::Diverging => colorous::RED_BLUE,
        }
    }
}

/// Places of corners in the picture, with the range they span and the border of a region where there is one.
pub fn coverage_points(points_px: &[Vector2<f64>], size_px: [u32; 2], region_px: &[[f64; 2]]) -> Panel {
    let (mut p, axes) = picture_axes(&format!("{} corners", points_px.len()), size_px, 0.0);
    for v in points_px {
        let at = axes.at(v.x, v.y);
        p.circle(at, 2.0, &format!("fill=\"{}\" fill-opacity=\"0.6\"", color::BLUE));
    }
    let border: Vec<[f64; 2]> =
        region_px.iter().chain(region_px.first()).map(|[x, y]| axes.at(*x, *y)).collect();
    if !border.is_empty() {
        p.path(&border, color::GREEN, 1.5);
    }
    let span = |k: usize| {
        let of = |f: fn(f64, f64) -> f64, start: f64| {
            points_px.iter().map(|v| v[k]).filter(|v| v.is_finite()).fold(start, f)
        };
        [of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY)]
    };
    if points_px.iter().any(|v| v.x.is_finite() && v.y.is_finite()) {
        let ([x0, x1], [y0, y1]) = (span(0), span(1));
        let (a, b) = (axes.at(x0, y0), axes.at(x1, y1));
        let style = format!("stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"6 4\"", color::ORANGE);
        p.rect(a[0], a[1], b[0] - a[0], b[1] - a[1], "none", &style);
        let share = |[lo, hi]: [f64; 2], n: u32| 100.0 * (hi - lo) / f64::from(n);
        let name = format!(
            "{:.1} × {:.1} % of the picture",
            share([x0, x1], size_px[0]),
            share([y0, y1], size_px[1])
        );
        p.text([b[0], a[1] - 6.0], &name, Type::TICK.anchored(Anchor::End).colored(color::ORANGE));
    }
    p
}

/// Number of corners in each of `columns` cells across the picture (and as many down as fit).
pub fn coverage_density(points_px: &[Vector2<f64>], size_px: [u32; 2], columns: usize) -> Panel {
    let [w, h] = size_px.map(|n| f64::from(n.max(1)));
    let columns = columns.max(1);
    let rows = ((columns as f64 * h / w).round() as usize).max(1);
    let mut values = vec![0.0; columns * rows];
    for v in points_px {
        let cell = |x: f64, n: f64, count: usize| ((x + 0.5) / n * count as f64) as usize;
        let (i, j) = (cell(v.x, w, columns), cell(v.y, h, rows));
        if i < columns && j < rows {
            values[j * columns + i] += 1.0;
        }
    }
    map("Density", "corners per cell", &Grid { columns, rows, values }, size_px, Scale::Sequential)
}

/// A map of numbers over the picture with a colour bar; `unit` names what the bar counts.
pub fn map(title: &str, unit: &str, grid: &Grid, size_px: [u32; 2], scale: Scale) -> Panel {
    let (mut p, axes) = picture_axes(title, size_px, 82.0);
    let [left, top, w, h] = axes.area;
    let is_log = scale == Scale::Logarithmic;
    let shown = |v: f64| if is_log { v.log10() } else { v };
    let finite = || grid.values.iter().map(|v| shown(*v)).filter(|v| v.is_finite());
    let range = match scale {
        Scale::Sequential => [finite().fold(0.0, f64::min), finite().fold(1e-12, f64::max)],
        Scale::Logarithmic => {
            let [lo, hi] =
                [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
            if lo < hi { [lo, hi] } else { [-1.0, 1.0] }
        }
        Scale::Diverging => {
            let reach = finite().fold(1e-12, |m, v| f64::max(m, v.abs()));
            [-reach, reach]
        }
    };
    let gradient = scale.gradient();
    let paint = |v: f64| {
        let t = (v - range[0]) / (range[1] - range[0]);
        if v.is_finite() { gradient.eval_continuous(t).as_array() } else { [238; 3] }
    };
    if let Some(png) =
        rgb_png(grid.columns, grid.rows, |i, j| paint(shown(grid.values[j * grid.columns + i])))
    {
        p.png(left, top, w, h, &png);
    }
    p.rect(left, top, w, h, "none", &format!("stroke=\"{}\"", color::MUTED));
    let bar = left + w + 14.0;
    let steps = 128;
    let up = |_: usize, j: usize| gradient.eval_rational(steps - 1 - j, steps).as_array();
    if let Some(png) = rgb_png(1, steps, up) {
        p.png(bar, top, 12.0, h, &png);
    }
    p.rect(bar, top, 12.0, h, "none", &format!("stroke=\"{}\"", color::MUTED));
    for v in ticks(range, 6) {
        let y = top + h * (1.0 - (v - range[0]) / (range[1] - range[0]));
        p.line([bar + 12.0, y], [bar + 16.0, y], color::MUTED, 1.0, "");
        let name = if is_log { format!("{:.1e}", 10f64.powf(v)) } else { label(v, range) };
        p.text([bar + 19.0, y + 4.0], &name, Type::TICK.anchored(Anchor::Start));
    }
    p.text_up([bar + 70.0, top + h / 2.0], unit, Type::LABEL);
    p
}

/// Axes over a picture: x to the right, y downwards, both in px.
fn picture_axes(title: &str, size_px: [u32; 2], right: f64) -> (Panel, Axes) {
    let [w, h] = size_px.map(|n| f64::from(n.max(1)));
    let scale = SIDE / w.max(h);
    let (width, height) = (w * scale, h * scale);
    let mut p = Panel::new(56.0 + width + 14.0 + right, 28.0 + height + 48.0);
    let axes = Axes { area: [56.0, 28.0, width, height], x: [-0.5, w - 0.5], y: [h - 0.5, -0.5] };
    p.text([0.0, 14.0], title, Type::TITLE);
    p.rect(56.0, 28.0, width, height, "#fff", &format!("stroke=\"{}\"", color::MUTED));
    for v in ticks([0.0, w], (width / 70.0) as usize) {
        let at = axes.at(v, 0.0)[0];
        p.line([at, 28.0 + height], [at, 28.0 + height + 4.0], color::MUTED, 1.0, "");
        p.text([at, 28.0 + height + 17.0], &label(v, [0.0, w]), Type::TICK);
    }
    for v in ticks([0.0, h], (height / 40.0) as usize) {
        let at = axes.at(0.0, v)[1];
        p.line([52.0, at], [56.0, at], color::MUTED, 1.0, "");
        p.text([48.0, at + 4.0], &label(v, [0.0, h]), Type::TICK.anchored(Anchor::End));
    }
    p.text([56.0 + width / 2.0, 28.0 + height + 38.0], "x, px", Type::LABEL);
    p.text_up([12.0, 28.0 + height / 2.0], "y, px", Type::LABEL);
    (p, axes)
}

/// A small colour picture as PNG; `None` where it is empty.
fn rgb_png(columns: usize, rows: usize, paint: impl Fn(usize, usize) -> [u8; 3]) -> Option<Vec<u8>> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let mut rgb = Vec::with_capacity(columns * rows * 3);
    for j in 0..rows {
        for i in 0..columns {
            rgb.extend(paint(i, j));
        }
    }
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&rgb, columns as u32, rows as u32, ExtendedColorType::Rgb8)
        .ok()
        .map(|()| bytes)
}
