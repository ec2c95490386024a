//! A page as PDF: 72 points to the inch, y upwards.

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};

use super::Page;

const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// Largest page of a PDF without a user unit, points.
const MAX_POINTS: f64 = 14_400.0;
const FONT: Name<'static> = Name(b"F1");

pub(super) fn write(page: &Page) -> Vec<u8> {
    let [w, h] = page.size;
    let unit = if w.max(h) * POINTS_PER_MM > MAX_POINTS { 10.0 } else { 1.0 };
    let pt = |mm: f64| (mm * POINTS_PER_MM / unit) as f32;
    let up = |mm: f64| pt(h - mm);

    let mut content = Content::new();
    content.set_fill_gray(0.0);
    // One path: within it, edges that two rectangles share leave no hairline.
    for [x, y, w, h] in &page.black {
        content.rect(pt(*x), up(y + h), pt(*w), pt(*h));
    }
    for [x, y, r] in &page.discs {
        disc(&mut content, [pt(*x), up(*y)], pt(*r));
    }
    content.fill_nonzero();
    content.set_line_width(pt(0.2));
    for [[x0, y0], [x1, y1]] in &page.lines {
        content.move_to(pt(*x0), up(*y0)).line_to(pt(*x1), up(*y1));
    }
    content.stroke();
    for text in &page.texts {
        content.begin_text().set_font(FONT, pt(text.size)).next_line(pt(text.at[0]), up(text.at[1]));
        content.show(Str(text.words.as_bytes())).end_text();
    }

    let [catalog, pages, sheet, font, stream] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(pages);
    // Viewers then offer "actual size" instead of "fit to page".
    root.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    root.finish();
    pdf.pages(pages).kids([sheet]).count(1);
    let mut p = pdf.page(sheet);
    p.media_box(Rect::new(0.0, 0.0, pt(w), pt(h))).parent(pages).contents(stream);
    if unit != 1.0 {
        p.user_unit(unit as f32);
    }
    p.resources().fonts().pair(FONT, font);
    p.finish();
    pdf.type1_font(font).base_font(Name(b"Helvetica"));
    pdf.stream(stream, &content.finish());
    pdf.finish()
}

/// A circle of four Bézier curves: 2.7e-4 of the radius off at most, a micrometre and a half on one of 6 mm.
fn disc(content: &mut Content, [x, y]: [f32; 2], r: f32) {
    // 4/3 (√2 − 1)
    let k = 0.552_284_8 * r;
    content.move_to(x + r, y);
    content.cubic_to(x + r, y + k, x + k, y + r, x, y + r);
    content.cubic_to(x - k, y + r, x - r, y + k, x - r, y);
    content.cubic_to(x - r, y - k, x - k, y - r, x, y - r);
    content.cubic_to(x + k, y - r, x + r, y - k, x + r, y);
    content.close_path();
}

#[cfg(test)]
mod tests {
    use crate::calib::board::{Kind, Sheet, pdf};

    #[test]
    fn squares_are_drawn_in_points() {
        let sheet = Sheet::new(Kind::Checkerboard, "9x6".parse().unwrap(), "25.4mm".parse().unwrap());
        let bytes = pdf(&sheet).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-1.") && text.trim_end().ends_with("%%EOF"));
        assert_eq!(text.matches(" 72 72 re").count(), 35, "{text}");
        assert!(text.contains("/PrintScaling /None") && text.contains("(9x6 inner corners, square 25.4 mm)"));
    }
}
