//! A page as SVG in mm.

use std::fmt::Write as _;

use super::Page;

/// At most a nanometre of rounding, without trailing zeros.
fn mm(v: f64) -> f64 {
    (v * 1e6).round() / 1e6
}

pub(super) fn write(page: &Page) -> String {
    let [w, h] = page.size.map(mm);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}mm\" height=\"{h}mm\" viewBox=\"0 0 {w} {h}\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n<path fill=\"black\" d=\""
    );
    let mut first = true;
    let mut line = || if std::mem::take(&mut first) { "" } else { "\n" };
    for [x, y, w, h] in &page.black {
        let [x, y, w, h] = [x, y, w, h].map(|v| mm(*v));
        let _ = write!(out, "{}M{x} {y}h{w}v{h}h-{w}z", line());
    }
    for [x, y, r] in &page.discs {
        let [x, y, r, d] = [x - r, *y, *r, 2.0 * r].map(mm);
        let _ = write!(out, "{}M{x} {y}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0z", line());
    }
    out += "\"/>\n<path stroke=\"black\" stroke-width=\"0.2\" fill=\"none\" d=\"";
    for [[x0, y0], [x1, y1]] in &page.lines {
        let _ = write!(out, "M{} {}L{} {}", mm(*x0), mm(*y0), mm(*x1), mm(*y1));
    }
    out += "\"/>\n<g font-family=\"Helvetica, Arial, sans-serif\" fill=\"black\">\n";
    for text in &page.texts {
        // The words are ours: digits, letters, blanks, % ; : and comma need no escape.
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\">{}</text>",
            mm(text.at[0]),
            mm(text.at[1]),
            mm(text.size),
            text.words
        );
    }
    out + "</g>\n</svg>\n"
}

#[cfg(test)]
mod tests {
    use crate::calib::board::{Kind, Sheet, svg};

    #[test]
    fn the_page_is_in_millimetres() {
        let text =
            svg(&Sheet::new(Kind::Checkerboard, "9x6".parse().unwrap(), "25mm".parse().unwrap())).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let root = document.root_element();
        assert_eq!(
            (root.attribute("width"), root.attribute("viewBox")),
            (Some("297mm"), Some("0 0 297 210"))
        );
        assert!(text.contains("M23.5 12.5h25v25h-25z") && text.contains("square 25 mm"));
    }
}
