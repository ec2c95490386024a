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
    let s = mm(page.square);
    for (i, [x, y]) in page.black.iter().enumerate() {
        let _ = write!(out, "{}M{} {}h{s}v{s}h-{s}z", if i == 0 { "" } else { "\n" }, mm(*x), mm(*y));
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
    use crate::calib::board::{Kind, svg};

    #[test]
    fn the_page_is_in_millimetres() {
        let text = svg(Kind::Checkerboard, "9x6".parse().unwrap(), "25mm".parse().unwrap()).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let root = document.root_element();
        assert_eq!(
            (root.attribute("width"), root.attribute("viewBox")),
            (Some("297mm"), Some("0 0 297 210"))
        );
        assert!(text.contains("M23.5 12.5h25v25h-25z") && text.contains("square 25 mm"));
    }
}
