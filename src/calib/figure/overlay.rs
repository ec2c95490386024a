//! Figures 2, 3, 5 and 7: photographs, alone and under what was found in them.

use nalgebra::Vector2;

use super::{
    color,
    svg::{Panel, Type},
};
use crate::calib::{image::Plane, observation::Corner, synth, target::BoardSize};

/// Width of a photograph under an overlay.
const WIDE: f64 = 420.0;
/// Width of a photograph in the contact sheet.
const SMALL: f64 = 200.0;

/// A corner where it was found and where the model puts it, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Observed.
    pub detected_px: Vector2<f64>,
    /// Projected.
    pub projected_px: Vector2<f64>,
}

/// A photograph under its title, and the scale of the page in units per px.
fn photograph(photo: &Plane<u8>, title: &str, width: f64) -> (Panel, f64) {
    let scale = width / photo.width().max(1) as f64;
    let height = scale * photo.height() as f64;
    let mut p = Panel::new(width, height + 22.0);
    p.text([0.0, 13.0], title, Type { size: 12.0, ..Type::TITLE });
    if let Ok(png) = synth::png(photo, false) {
        p.png(0.0, 22.0, width, height, &png);
    }
    (p, scale)
}

/// Place of a pixel on the page.
fn on_page(px: &Vector2<f64>, scale: f64) -> [f64; 2] {
    [(px.x + 0.5) * scale, (px.y + 0.5) * scale + 22.0]
}

/// All pictures with their names (Figure 2). Large photographs are reduced.
pub fn contact_sheet(pictures: &[(String, &Plane<u8>)], columns: usize) -> Panel {
    let tiles: Vec<Panel> = pictures.iter().map(|(name, p)| photograph(&reduced(p), name, SMALL).0).collect();
    Panel::grid(&tiles, columns)
}

/// Corners joined in the order of their indices, a colour a board row; the first corner is ringed (Figure 3).
pub fn corner_order(photo: &Plane<u8>, board: BoardSize, corners: &[Corner], title: &str) -> Panel {
    let (mut p, scale) = photograph(photo, title, WIDE);
    let row_color = |row: u32| {
        let t = f64::from(row) / f64::from(board.rows.max(2) - 1);
        let [r, g, b] = colorous::TURBO.eval_continuous(0.08 + 0.84 * t).as_array();
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    for pair in corners.windows(2) {
        let stroke = row_color(board.at(pair[1].index)[1]);
        let [a, b] = [0, 1].map(|k| on_page(&pair[k].px, scale));
        p.line(a, b, &stroke, 1.4, "");
    }
    for c in corners {
        let style =
            format!("fill=\"{}\" stroke=\"#fff\" stroke-width=\"0.6\"", row_color(board.at(c.index)[1]));
        p.circle(on_page(&c.px, scale), 2.6, &style);
    }
    if let Some(first) = corners.first() {
        let style = format!("fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"", color::RED);
        p.circle(on_page(&first.px, scale), 6.5, &style);
    }
    p
}

/// Detected corners as green circles, projected ones as blue, joined by red segments that are `times` as long as the
/// residual (Figure 5).
pub fn reprojection(photo: &Plane<u8>, pairs: &[Pair], times: f64, title: &str) -> Panel {
    let (mut p, scale) = photograph(photo, title, WIDE);
    let ring = |c: &str| format!("fill=\"none\" stroke=\"{c}\" stroke-width=\"1.3\"");
    for pair in pairs {
        let from = on_page(&pair.projected_px, scale);
        let to = on_page(&(pair.projected_px + (pair.detected_px - pair.projected_px) * times), scale);
        p.circle(on_page(&pair.detected_px, scale), 4.2, &ring("#14b866"));
        p.circle(from, 2.6, &ring("#2b7fff"));
        p.line(from, to, color::RED, 1.6, "stroke-linecap=\"round\"");
    }
    p
}

/// A picture beside its undistorted self (Figure 7).
pub fn before_after(before: &Plane<u8>, after: &Plane<u8>, title: &str) -> Panel {
    let left = photograph(before, &format!("{title}: as taken"), WIDE).0;
    let right = photograph(after, &format!("{title}: undistorted"), WIDE).0;
    Panel::beside(&[left, right])
}

/// Mean over blocks, so that the page holds about twice the pixels that are shown.
fn reduced(photo: &Plane<u8>) -> Plane<u8> {
    let k = photo.width() / (2.0 * SMALL) as usize;
    if k < 2 {
        return photo.clone();
    }
    Plane::from_fn(photo.width() / k, photo.height() / k, |x, y| {
        let block = (0..k).flat_map(|j| &photo.row(y * k + j)[x * k..(x + 1) * k]);
        let sum: u32 = block.map(|&v| u32::from(v)).sum();
        (sum / (k * k) as u32) as u8
    })
}
