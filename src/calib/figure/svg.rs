//! A small SVG writer: shapes, text, embedded pictures, and panels that are put together.

use base64::{Engine, engine::general_purpose::STANDARD};
use std::fmt::Write;

use super::color;

/// Fonts in order of preference; the last is the viewer's own.
const FONTS: &str = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif";
/// Space between panels.
const GAP: f64 = 24.0;

/// A drawing of a given size, to be combined with others or written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Width in user units (CSS px).
    pub width: f64,
    /// Height in user units.
    pub height: f64,
    body: String,
}

/// Where text is anchored.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Appearance of text.
#[derive(Clone, Copy)]
pub(super) struct Type {
    pub(super) size: f64,
    pub(super) color: &'static str,
    pub(super) bold: bool,
    pub(super) anchor: Anchor,
}

impl Type {
    /// Title of a panel.
    pub(super) const TITLE: Self = Self { size: 14.0, color: color::INK, bold: true, anchor: Anchor::Start };
    /// Names of axes, legends.
    pub(super) const LABEL: Self =
        Self { size: 12.0, color: color::INK, bold: false, anchor: Anchor::Middle };
    /// Numbers at ticks.
    pub(super) const TICK: Self =
        Self { size: 11.0, color: color::MUTED, bold: false, anchor: Anchor::Middle };

    pub(super) const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    pub(super) const fn colored(self, color: &'static str) -> Self {
        Self { color, ..self }
    }
}

impl Panel {
    /// An empty panel.
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    /// The panel as a whole SVG file on a white ground.
    pub fn svg(&self) -> String {
        let margin = 16.0;
        let (w, h) = ((self.width + 2.0 * margin).ceil(), (self.height + 2.0 * margin).ceil());
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"{FONTS}\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n\
             <g transform=\"translate({margin} {margin})\">\n{}</g>\n</svg>\n",
            self.body
        )
    }

    /// Panels from left to right, tops aligned.
    pub fn beside(panels: &[Self]) -> Self {
        let mut out = Self::default();
        for p in panels {
            let x = if out.width > 0.0 { out.width + GAP } else { 0.0 };
            out.place(p, x, 0.0);
        }
        out
    }

    /// Panels from top to bottom.
    pub fn stacked(panels: &[Self]) -> Self {
        let mut out = Self::default();
        for p in panels {
            let y = if out.height > 0.0 { out.height + GAP } else { 0.0 };
            out.place(p, 0.0, y);
        }
        out
    }

    /// Rows of `columns` panels each.
    pub fn grid(panels: &[Self], columns: usize) -> Self {
        Self::stacked(&panels.chunks(columns.max(1)).map(Self::beside).collect::<Vec<_>>())
    }

    /// Draws another panel into this one, which grows to hold it.
    pub(super) fn place(&mut self, other: &Self, x: f64, y: f64) {
        let _ = writeln!(
            self.body,
            "<g transform=\"translate({} {})\">\n{}</g>",
            number(x),
            number(y),
            other.body
        );
        self.width = self.width.max(x + other.width);
        self.height = self.height.max(y + other.height);
    }

    /// A line; `style` is further SVG attributes.
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: &str, width: f64, style: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(number);
        let _ = writeln!(
            self.body,
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{stroke}\" stroke-width=\"{width}\" {style}/>"
        );
    }

    /// A filled rectangle.
    pub(super) fn rect(&mut self, x: f64, y: f64, w: f64, h: f64, fill: &str, style: &str) {
        let [x, y, w, h] = [x, y, w.max(0.0), h.max(0.0)].map(number);
        let _ = writeln!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" fill=\"{fill}\" {style}/>"
        );
    }

    /// A circle.
    pub(super) fn circle(&mut self, at: [f64; 2], r: f64, style: &str) {
        let [x, y, r] = [at[0], at[1], r].map(number);
        let _ = writeln!(self.body, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" {style}/>");
    }

    /// An open path through points.
    pub(super) fn path(&mut self, points: &[[f64; 2]], stroke: &str, width: f64) {
        let mut d = String::new();
        for (i, p) in points.iter().enumerate() {
            let _ = write!(d, "{}{} {}", if i == 0 { "M" } else { "L" }, number(p[0]), number(p[1]));
        }
        let _ = writeln!(
            self.body,
            "<path d=\"{d}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"/>"
        );
    }

    /// Text with its baseline at `at`.
    pub(super) fn text(&mut self, at: [f64; 2], text: &str, ty: Type) {
        self.text_with(at, text, ty, "");
    }

    /// Text that reads upwards.
    pub(super) fn text_up(&mut self, at: [f64; 2], text: &str, ty: Type) {
        let turn = format!("transform=\"rotate(-90 {} {})\"", number(at[0]), number(at[1]));
        self.text_with(at, text, ty, &turn);
    }

    /// Text over data: a white rim keeps it readable.
    pub(super) fn text_over(&mut self, at: [f64; 2], text: &str, ty: Type) {
        self.text_with(
            at,
            text,
            ty,
            "stroke=\"#fff\" stroke-width=\"3.5\" stroke-linejoin=\"round\" paint-order=\"stroke\"",
        );
    }

    fn text_with(&mut self, at: [f64; 2], text: &str, ty: Type, style: &str) {
        let anchor = match ty.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if ty.bold { " font-weight=\"600\"" } else { "" };
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{}\" text-anchor=\"{anchor}\"{weight} {style}>{}</text>",
            number(at[0]),
            number(at[1]),
            ty.size,
            ty.color,
            escape(text)
        );
    }

    /// A PNG file stretched over a rectangle.
    pub(super) fn png(&mut self, x: f64, y: f64, w: f64, h: f64, png: &[u8]) {
        let _ = writeln!(
            self.body,
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            number(x),
            number(y),
            number(w),
            number(h),
            STANDARD.encode(png)
        );
    }
}

/// A coordinate with at most two decimals; what is not finite becomes 0, which SVG can read.
pub(super) fn number(v: f64) -> String {
    if !v.is_finite() {
        return "0".to_owned();
    }
    let text = format!("{v:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
