//! Whether a board was photographed from a screen: the pixels of a display make a fine regular pattern in its white squares.
//!
//! The pattern, or the moiré that it makes with the pixels of the camera, is a line in the spectrum of a white square: one frequency
//! far above its neighbours. Paper, noise and compression have spectra without lines, or with lines whose place is known: JPEG's blocks
//! and the camera's colour filter repeat after 8 px or a divisor, and a pattern that does so too is not told from them. In one
//! square chance makes a line now and then, but not the same one in most squares.
//!
//! P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra", IEEE Trans. Audio 15(2), 1967; the largest of
//! M values of a periodogram: R. A. Fisher, "Tests of significance in harmonic analysis", Proc. R. Soc. A 125, 1929.

use nalgebra::Vector2;

use super::{
    detect::{Grid, GridCorner},
    image::Gray,
    order,
};

/// Sides of the windows in squares, px, of which the largest that fits is taken; multiples of 8, or JPEG's blocks have no frequency.
const SIDES: [usize; 2] = [32, 24];
/// Squares that are looked at.
const SQUARES: usize = 7;
/// Least squares that say anything.
const FEWEST: usize = 4;
/// Shares of a square at which its window lies: what is nearer to an edge is blurred.
const INSIDE: f64 = 0.15;
/// Waves in a window from which on a pattern is told from uneven light.
const WAVES: f64 = 3.0;
/// A line is so many times as strong as the mean of its neighbours: noise goes there, at any of 500 frequencies, once in 2000 squares.
const LINE: f64 = 14.0;
/// Share by which the frequency may change over a board that is tilted.
const CHANGE: f64 = 0.3;

/// Whether most white squares of a grid show one regular pattern; `false` too where they are too small to tell.
pub fn is_shown(picture: &Gray, grid: &Grid) -> bool {
    let squares = white_squares(picture, grid);
    let fits =
        |side: &&usize| squares.iter().filter(|s| s.holds(**side)).count() >= FEWEST.max(squares.len() / 2);
    let Some(&side) = SIDES.iter().find(fits) else { return false };
    let mut usable: Vec<&Square> = squares.iter().filter(|s| s.holds(side)).collect();
    let every = usable.len().div_ceil(SQUARES);
    usable = usable.into_iter().step_by(every).collect();
    let spectrum = Spectrum::new(side);
    let lines: Vec<Vector2<f64>> = usable.iter().filter_map(|s| spectrum.line(picture, &s.middle)).collect();
    let same = |a: &Vector2<f64>| {
        // A frequency and its opposite are one, and rows and columns of pixels are one pattern.
        let near = |b: &Vector2<f64>| (b - a).norm().min((b + a).norm()) <= CHANGE * a.norm();
        lines.iter().filter(|b| near(b) || near(&Vector2::new(-b.y, b.x))).count()
    };
    lines.iter().map(same).max().is_some_and(|n| n >= FEWEST && 2 * n > usable.len())
}

/// A square of the board in the picture.
struct Square {
    corners: [Vector2<f64>; 4],
    middle: Vector2<f64>,
}

impl Square {
    /// Whether an upright window of this side about its middle lies well inside.
    fn holds(&self, side: usize) -> bool {
        let half = side as f64 / 2.0;
        let inner = self.corners.map(|c| self.middle + (c - self.middle) * (1.0 - 2.0 * INSIDE));
        (0..4).all(|i| {
            let (a, b) = (inner[i], inner[(i + 1) % 4]);
            let along = b - a;
            // Distance of the middle from the side, and how far the window reaches towards it.
            let away = (along.perp(&(self.middle - a)) / along.norm()).abs();
            away >= half * (along.x.abs() + along.y.abs()) / along.norm()
        })
    }
}

/// The brighter ones of the squares that have all four corners.
fn white_squares(picture: &Gray, grid: &Grid) -> Vec<Square> {
    let at = order::map(grid.corners.iter().map(|c| (c.cell, c.px)));
    let mut colours: [Vec<Square>; 2] = Default::default();
    let mut light = [0.0; 2];
    for GridCorner { cell: [c, r], px, .. } in &grid.corners {
        let corners = [[c + 1, *r], [c + 1, r + 1], [*c, r + 1]].map(|cell| at.get(&cell).copied());
        let [Some(right), Some(across), Some(below)] = corners else { continue };
        let corners = [*px, right, across, below];
        let middle = corners.iter().sum::<Vector2<f64>>() / 4.0;
        let colour = ((c + r) % 2) as usize;
        light[colour] += value(picture, middle.x, middle.y);
        colours[colour].push(Square { corners, middle });
    }
    let mean = |i: usize| light[i] / colours[i].len().max(1) as f64;
    let white = usize::from(mean(1) > mean(0));
    std::mem::take(&mut colours[white])
}

/// Grey value of the nearest pixel; those outside are black.
fn value(picture: &Gray, x: f64, y: f64) -> f64 {
    let [w, h] = picture.size();
    let (x, y) = (x.round(), y.round());
    if x < 0.0 || y < 0.0 || x >= w as f64 || y >= h as f64 {
        return 0.0;
    }
    match picture {
        Gray::U8(p) => f64::from(p.at(x as usize, y as usize)),
        Gray::U16(p) => f64::from(p.at(x as usize, y as usize)),
    }
}

/// Power spectra of square windows.
struct Spectrum {
    side: usize,
    /// Cosine and sine of the multiples of a turn's `side`-th part.
    turns: Vec<[f64; 2]>,
    /// Hann's window.
    window: Vec<f64>,
}

impl Spectrum {
    fn new(side: usize) -> Self {
        let turn = |i: usize| std::f64::consts::TAU * i as f64 / side as f64;
        Self {
            side,
            turns: (0..side).map(|i| [turn(i).cos(), turn(i).sin()]).collect(),
            window: (0..side).map(|i| 0.5 - 0.5 * (turn(i) + 0.5 * turn(1)).cos()).collect(),
        }
    }

    /// The frequency, in waves a window, that stands out of the spectrum about a place.
    fn line(&self, picture: &Gray, middle: &Vector2<f64>) -> Option<Vector2<f64>> {
        let n = self.side as i32;
        let power = self.power(picture, middle);
        // Half of the frequencies: the others are their opposites.
        let at = |u: i32, v: i32| {
            let (u, v) = if u < 0 { (-u, -v) } else { (u, v) };
            power[u as usize * self.side + v.rem_euclid(n) as usize]
        };
        let half = n / 2;
        let all = || (0..half).flat_map(|u| (1 - half..half).map(move |v| [u, v]));
        let radius = |[u, v]: [i32; 2]| f64::from(u).hypot(f64::from(v));
        // Lines whose place is known.
        let known = |k: i32| 8 * k % n == 0;
        let is_peak = |[u, v]: [i32; 2]| {
            let around = (-1..=1).flat_map(|du| (-1..=1).map(move |dv| [u + du, v + dv]));
            around.into_iter().all(|[a, b]| at(a, b) <= at(u, v))
        };
        let told = |f: &[i32; 2]| radius(*f) >= WAVES && !(known(f[0]) && known(f[1])) && is_peak(*f);
        let strongest = all().filter(told).max_by(|a, b| at(a[0], a[1]).total_cmp(&at(b[0], b[1])))?;
        let peak = at(strongest[0], strongest[1]);
        // Rows of pixels have a line as strong as columns have, a quarter turn away.
        let near = |f: &[i32; 2]| {
            let [u, v] = strongest;
            let apart = |[u, v]: [i32; 2]| (f[0] - u).abs().max((f[1] - v).abs());
            [[u, v], [-u, -v], [-v, u], [v, -u]].into_iter().any(|line| apart(line) <= 2)
        };
        let mean = |of: &dyn Fn(&[i32; 2]) -> bool| {
            let (sum, count) = all()
                .filter(|f| radius(*f) >= WAVES && !near(f) && of(f))
                .fold((0.0, 0usize), |(sum, count), f| (sum + at(f[0], f[1]), count + 1));
            sum / count.max(1) as f64
        };
        // Of equal length; on an axis also of the same direction, where the noise of rows and columns is.
        let ring = mean(&|f| (radius(*f) - radius(strongest)).abs() <= 2.0);
        let [row, column] = strongest.map(|k| k.abs() <= 1);
        let axis = if row || column { mean(&|f| f[usize::from(column)].abs() <= 1) } else { 0.0 };
        (peak > LINE * ring.max(axis).max(f64::MIN_POSITIVE))
            .then(|| Vector2::new(f64::from(strongest[0]), f64::from(strongest[1])))
    }

    /// Power at `[u · side + v]`, u up to half of the side: waves across and down.
    fn power(&self, picture: &Gray, middle: &Vector2<f64>) -> Vec<f64> {
        let n = self.side;
        let first = middle.map(|m| m.round() - (n / 2) as f64);
        let mut values = vec![0.0; n * n];
        for (i, to) in values.iter_mut().enumerate() {
            *to = value(picture, first.x + (i % n) as f64, first.y + (i / n) as f64);
        }
        let mean = values.iter().sum::<f64>() / (n * n) as f64;
        for (i, to) in values.iter_mut().enumerate() {
            *to = (*to - mean) * self.window[i % n] * self.window[i / n];
        }
        // Multiples of a frequency, without a division for each.
        let steps = |k: usize| {
            let mut at = 0;
            std::iter::repeat_with(move || {
                let now = at;
                at = if at + k < n { at + k } else { at + k - n };
                self.turns[now]
            })
        };
        let mut power = vec![0.0; (n / 2 + 1) * n];
        let mut column = vec![[0.0; 2]; n];
        for u in 0..=n / 2 {
            for (row, to) in values.chunks_exact(n).zip(&mut column) {
                *to = row
                    .iter()
                    .zip(steps(u))
                    .fold([0.0; 2], |[re, im], (value, [cos, sin])| [re + value * cos, im - value * sin]);
            }
            for v in 0..n {
                let [re, im] =
                    column.iter().zip(steps(v)).fold([0.0; 2], |[re, im], ([a, b], [cos, sin])| {
                        [re + a * cos + b * sin, im + b * cos - a * sin]
                    });
                power[u * n + v] = re * re + im * im;
            }
        }
        power
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{
        detect::{Options, detect},
        image::Plane,
        synth::{Degrade, Renderer, Scene},
    };

    /// Where each pixel of a view meets the board, in squares.
    pub(crate) fn places(scene: &Scene, view: usize) -> Plane<[f32; 2]> {
        let [w, h] = scene.camera.size_px.map(|n| n as usize);
        let board_from_camera = scene.camera_from_board(view).unwrap().inverse();
        Plane::from_fn(w, h, |x, y| {
            let ray = scene.camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap_or_else(Vector3::z);
            let (from, along) = (board_from_camera.translation, board_from_camera.rotation * ray);
            let meets = from - along * (from.z / along.z);
            [meets.x, meets.y].map(|v| (v / scene.board.square) as f32)
        })
    }

    /// The light of a view whose board is shown by a display with so many pixels a square, each with a dark rim of a tenth.
    fn on_screen(scene: &Scene, view: usize, pixels: f32, light: &Plane<f32>) -> Plane<f32> {
        const PARTS: i32 = 5;
        let at = places(scene, view);
        let (w, h) = (light.width(), light.height());
        Plane::from_fn(w, h, |x, y| {
            let [p, across, down] = [at.at(x, y), at.at((x + 1).min(w - 1), y), at.at(x, (y + 1).min(h - 1))];
            let mut lit = 0;
            for i in 0..PARTS * PARTS {
                let [u, v] = [i % PARTS, i / PARTS].map(|k| (k as f32 + 0.5) / PARTS as f32 - 0.5);
                let inside = |k: usize| {
                    let place = p[k] + (across[k] - p[k]) * u + (down[k] - p[k]) * v;
                    (0.1..0.9).contains(&(place * pixels).rem_euclid(1.0))
                };
                lit += i32::from(inside(0) && inside(1));
            }
            light.at(x, y) * lit as f32 / (PARTS * PARTS) as f32
        })
    }

    /// Views in which a screen is seen, of those in which a board is found.
    fn shown(scene: &Scene, pixels: Option<f32>) -> [usize; 2] {
        let renderer = Renderer::new(scene).unwrap();
        let mut counts = [0, 0];
        for view in 0..scene.poses.len() {
            let light = renderer.light(view).unwrap();
            let light = pixels.map_or_else(|| light.clone(), |pixels| on_screen(scene, view, pixels, &light));
            let picture = Gray::U8(scene.degrade.apply(light, scene, view).unwrap());
            let Some(grid) = detect(&picture, &Options::default()).grid else { continue };
            counts[0] += usize::from(is_shown(&picture, &grid));
            counts[1] += 1;
        }
        counts
    }

    /// In every view, while a pixel of the display is wider than the two of the camera that a wave takes: with squares of 50 px and
    /// more, up to some 20 a square. At 10 to 14, many views have lines beside those of compression.
    #[test]
    fn the_pixels_of_a_display_are_seen() {
        let degrade = Degrade { blur: 0.6, noise: 2.0, ..Degrade::default() };
        let scene = Scene { degrade, ..Scene::seed() };
        for pixels in [10.0, 14.0, 20.0] {
            let [seen, of] = shown(&scene, Some(pixels));
            assert!(of >= 12 && seen == of, "{pixels} pixels a square: {seen} of {of}");
        }
    }

    #[test]
    fn paper_is_no_screen() {
        for degrade in [
            Degrade::default(),
            Degrade { noise: 5.0, blur: 1.0, light: 0.4, ..Degrade::default() },
            Degrade { noise: 4.0, blur: 0.7, jpeg: Some(50), ..Degrade::default() },
            Degrade { noise: 1.0, jpeg: Some(15), vignette: 0.5, ..Degrade::default() },
        ] {
            let scene = Scene { degrade: degrade.clone(), ..Scene::seed() };
            let [seen, of] = shown(&scene, None);
            assert!(seen == 0 && of >= 12, "{degrade:?}: {seen} of {of}");
        }
    }
}
