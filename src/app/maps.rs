//! Maps over a picture: a grid of values as a smooth image, and its contours.

use egui::{Color32, ColorImage, Painter, Pos2, Rect, Shape, Stroke, Ui, pos2};
use nalgebra::Vector2;

use super::{picture_view::Place, style::CONTOUR, widgets::plate};

/// Values at the middles of equal cells of a picture, rows from the top; none where there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Row-major.
    pub values: Vec<Option<f64>>,
    /// In a row.
    pub columns: usize,
}

impl Grid {
    /// From rows.
    pub fn from_rows(rows: &[Vec<Option<f64>>]) -> Self {
        Self { values: rows.concat(), columns: rows.first().map_or(0, Vec::len) }
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.values.len().checked_div(self.columns).unwrap_or(0)
    }

    fn at(&self, x: usize, y: usize) -> Option<f64> {
        self.values.get(y * self.columns + x).copied().flatten()
    }

    /// Between the cells; none where one of the four neighbours has no answer. Beyond the outermost middles the nearest holds.
    fn between(&self, x: f64, y: f64) -> Option<f64> {
        let (x, y) = (x.clamp(0.0, (self.columns - 1) as f64), y.clamp(0.0, (self.rows() - 1) as f64));
        let (i, j) = (x.floor() as usize, y.floor() as usize);
        let (u, v) = (x - i as f64, y - j as f64);
        let (i1, j1) = ((i + 1).min(self.columns - 1), (j + 1).min(self.rows() - 1));
        let top = self.at(i, j)? * (1.0 - u) + self.at(i1, j)? * u;
        let bottom = self.at(i, j1)? * (1.0 - u) + self.at(i1, j1)? * u;
        Some(top * (1.0 - v) + bottom * v)
    }

    /// A smooth image, `wide` px wide; `color` of a value, transparent where there is none.
    pub fn image(&self, wide: usize, color: impl Fn(f64) -> Color32) -> ColorImage {
        if self.columns == 0 || self.rows() == 0 {
            return ColorImage::filled([1, 1], Color32::TRANSPARENT);
        }
        let high = (wide * self.rows() / self.columns).max(1);
        let pixel = |k: usize| {
            let middle = |i: usize, n: usize, cells: usize| (i as f64 + 0.5) / n as f64 * cells as f64 - 0.5;
            let value =
                self.between(middle(k % wide, wide, self.columns), middle(k / wide, high, self.rows()));
            value.map_or(Color32::TRANSPARENT, &color)
        };
        ColorImage::new([wide, high], (0..wide * high).map(pixel).collect())
    }

    /// Pieces of the contour at a level, in shares of width and height (W. Lorensen, H. Cline's marching cubes in two
    /// dimensions).
    pub fn contour(&self, level: f64) -> Vec<[[f64; 2]; 2]> {
        let mut pieces = Vec::new();
        let share = |x: f64, y: f64| [(x + 0.5) / self.columns as f64, (y + 0.5) / self.rows() as f64];
        for j in 0..self.rows().saturating_sub(1) {
            for i in 0..self.columns.saturating_sub(1) {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|(x, y)| self.at(x, y)) else {
                    continue;
                };
                let v = [a, b, c, d];
                // A contour that has come in goes out again before the next one comes in.
                let mut entered = None;
                for k in 0..4 {
                    let (a, b) = (v[k], v[(k + 1) % 4]);
                    if (a < level) != (b < level) {
                        let s = (level - a) / (b - a);
                        let [p, q] = [corners[k], corners[(k + 1) % 4]].map(|(x, y)| [x as f64, y as f64]);
                        let cut = share(p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]));
                        match entered.take() {
                            None => entered = Some(cut),
                            Some(from) => pieces.push([from, cut]),
                        }
                    }
                }
            }
        }
        pieces
    }
}

/// Most dots that are drawn: more are not told apart, and cost time in every frame.
const MOST_DOTS: usize = 4000;

/// Draws positions in a picture as dots; of very many, evenly chosen ones.
pub fn dots(painter: &Painter, place: &Place, px: &[Vector2<f64>], radius: f32, color: Color32) {
    let shown = px.iter().step_by(px.len().div_ceil(MOST_DOTS).max(1));
    painter.extend(shown.map(|p| Shape::circle_filled(place.point([p.x, p.y]), radius, color)));
}

/// Draws contours with their labels; the labels stand on their left sides, clear of each other.
pub fn contours(ui: &Ui, rect: Rect, grid: &Grid, levels: &[(f64, String)]) {
    let place =
        |[x, y]: [f64; 2]| pos2(rect.left() + rect.width() * x as f32, rect.top() + rect.height() * y as f32);
    let painter = ui.painter_at(rect);
    let mut labels: Vec<(Pos2, &str)> = Vec::new();
    let curves: Vec<_> =
        levels.iter().map(|(l, label)| (grid.contour(*l), label)).filter(|c| !c.0.is_empty()).collect();
    for (i, (pieces, label)) in curves.iter().enumerate() {
        let shapes = pieces
            .iter()
            .map(|[a, b]| Shape::line_segment([place(*a), place(*b)], Stroke::new(1.0, CONTOUR)));
        painter.extend(shapes);
        // Labels keep away from each other.
        let spots = pieces.iter().map(|[a, _]| place(*a));
        let clear =
            |p: &Pos2| labels.iter().all(|(q, _)| (p.x - q.x).abs() > 34.0 || (p.y - q.y).abs() > 20.0);
        // Each level in a direction of its own, from the lower left to the upper left: curves that lie close have labels that do not.
        let turn = 2.1 * (i as f32 / curves.len() as f32 - 0.5);
        let way = egui::Vec2::angled(std::f32::consts::PI + turn) * rect.size();
        let best = spots.filter(clear).min_by(|a, b| {
            let off = |p: &Pos2| {
                let d = *p - rect.center();
                let beside = (way.x * d.y - way.y * d.x).abs() / way.length();
                if d.dot(way) > 0.0 { beside } else { beside + d.length() }
            };
            off(a).total_cmp(&off(b))
        });
        if let Some(at) = best {
            labels.push((at, label));
        }
    }
    for (at, label) in labels {
        plate(&painter, rect, at, egui::Align2::CENTER_CENTER, label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contour_of_a_ramp_is_straight() {
        let values = (0..5).flat_map(|_| (0..10).map(|x| Some(f64::from(x)))).collect();
        let grid = Grid { values, columns: 10 };
        let pieces = grid.contour(4.25);
        assert_eq!(pieces.len(), 4);
        for [x, _] in pieces.iter().flatten() {
            assert!((x - 0.475).abs() < 1e-12);
        }
        assert_eq!(grid.between(4.25, 2.0), Some(4.25));
        assert!(grid.contour(99.0).is_empty());
    }

    #[test]
    fn holes_stay_holes() {
        let grid = Grid { values: vec![Some(0.0), None, Some(2.0), Some(3.0)], columns: 2 };
        assert!(grid.contour(1.0).is_empty() && grid.between(0.5, 0.5).is_none());
        assert_eq!(grid.image(2, |_| Color32::WHITE).size, [2, 2]);
    }
}
