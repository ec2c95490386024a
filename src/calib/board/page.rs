//! What is where on the paper, mm from its top-left corner.

use super::Sheet;
use crate::calib::{
    Result,
    target::{BoardSize, Target, Unit},
};

/// Papers, portrait, mm; tried in this order.
const METRIC: [(&str, [f64; 2]); 6] = [
    ("A4", [210.0, 297.0]),
    ("Letter", [215.9, 279.4]),
    ("A3", [297.0, 420.0]),
    ("A2", [420.0, 594.0]),
    ("A1", [594.0, 841.0]),
    ("A0", [841.0, 1189.0]),
];
/// The same where the square is in inches.
const IMPERIAL: [(&str, [f64; 2]); 6] = [
    ("Letter", [215.9, 279.4]),
    ("A4", [210.0, 297.0]),
    ("Tabloid", [279.4, 431.8]),
    ("ANSI C", [431.8, 558.8]),
    ("ANSI D", [558.8, 863.6]),
    ("ANSI E", [863.6, 1117.6]),
];

/// Strip below the board for ruler and a line or two of words, mm.
const FOOTER: f64 = 10.0;
/// Distance of two lines of words, mm.
const LINE: f64 = 4.0;
/// Width of a letter of Helvetica in font sizes, on average and from above.
const LETTER: f64 = 0.52;
/// Edge that printers leave blank, mm.
const BLANK: f64 = 5.0;
/// Height of the letters' line, mm.
const FONT: f64 = 2.8;

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// Left end of the base line, mm.
    pub at: [f64; 2],
    /// Font size, mm.
    pub size: f64,
    /// The words, ASCII.
    pub words: String,
}

/// A printed page, mm from its top-left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Name of the paper.
    pub paper: String,
    /// Width and height.
    pub size: [f64; 2],
    /// Black rectangles: x, y, width, height.
    pub black: Vec<[f64; 4]>,
    /// Black discs: x and y of the centre, radius.
    pub discs: Vec<[f64; 3]>,
    /// Thin lines of the ruler, from and to.
    pub lines: Vec<[[f64; 2]; 2]>,
    /// Texts.
    pub texts: Vec<Text>,
}

impl Page {
    /// Lays out a board.
    ///
    /// It has a white margin of a square where the paper has room for it, and of half a square at least.
    ///
    /// # Errors
    /// Those of [`Sheet::target`], and of [`crate::calib::marker::board::MarkerBoard::ink`].
    pub fn new(sheet: &Sheet) -> Result<Self> {
        let (target, edge, unit) = (sheet.target()?, sheet.square_mm()?, sheet.square.unit);
        let captions = sheet.words()?;
        let footer = FOOTER.max(LINE * captions.len() as f64 + 3.0);
        let Ink { extent: [low, high], mut black, mut discs } = ink(&target)?;
        let board = [high[0] - low[0], high[1] - low[1]];
        let (paper, size) = paper(board, edge, unit, footer);
        let shift = [(size[0] - board[0]) / 2.0 - low[0], (size[1] - footer - board[1]) / 2.0 - low[1]];
        for [x, y, ..] in &mut black {
            (*x, *y) = (*x + shift[0], *y + shift[1]);
        }
        for [x, y, _] in &mut discs {
            (*x, *y) = (*x + shift[0], *y + shift[1]);
        }
        let mut page = Self { paper, size, black, discs, lines: Vec::new(), texts: Vec::new() };
        let words_end = page.rule(unit);
        for (i, caption) in captions.iter().enumerate() {
            let x = page.size[0] - BLANK - width(caption);
            // Beside the words of the ruler where there is room for all of it, else above them.
            let above = if captions.len() == 1 && x > words_end + 2.0 { 0 } else { captions.len() - i };
            page.write(x, LINE * above as f64, caption);
        }
        Ok(page)
    }

    /// Ruler with ticks and what to do with it; answers where the words end, mm.
    fn rule(&mut self, unit: Unit) -> f64 {
        let (ticks, step, long, words) = match unit {
            Unit::In => (16, 25.4 / 4.0, 4, "print at 100 %; check with a ruler: 4 in"),
            _ => (20, 5.0, 2, "print at 100 %; check with a ruler: 100 mm"),
        };
        let y = self.size[1] - BLANK;
        let x = |i: u32| BLANK + f64::from(i) * step;
        self.lines.push([[x(0), y], [x(ticks), y]]);
        for i in 0..=ticks {
            let height = if i == 0 || i == ticks {
                4.0
            } else if i % long == 0 {
                2.5
            } else {
                1.5
            };
            self.lines.push([[x(i), y], [x(i), y - height]]);
        }
        self.write(x(ticks) + 2.0, 0.0, words);
        x(ticks) + 2.0 + width(words)
    }

    /// A line of words, `up` above the lowest.
    fn write(&mut self, x: f64, up: f64, words: &str) {
        self.texts.push(Text { at: [x, self.size[1] - BLANK - up], size: FONT, words: words.to_owned() });
    }
}

/// Width of a line of words from above, mm.
fn width(words: &str) -> f64 {
    LETTER * FONT * words.len() as f64
}

/// What is printed black, mm in a frame of the board.
struct Ink {
    /// Smallest and largest x and y.
    extent: [[f64; 2]; 2],
    black: Vec<[f64; 4]>,
    discs: Vec<[f64; 3]>,
}

fn ink(target: &Target) -> Result<Ink> {
    let mut discs = Vec::new();
    let black = match target {
        Target::Checkerboard { size, square } => squares(*size, *square),
        Target::Markers { board, scale } => board.ink()?.into_iter().map(|b| b.map(|v| v * scale)).collect(),
        Target::Circles { radius, .. } => {
            discs.extend(target.points_in_board().iter().map(|p| [p.x, p.y, *radius]));
            Vec::new()
        }
        Target::Points { .. } => Vec::new(),
    };
    let boxes = || {
        let of_discs = discs.iter().map(|[x, y, r]| [x - r, y - r, 2.0 * r, 2.0 * r]);
        black.iter().copied().chain(of_discs)
    };
    let low = |k: usize| boxes().map(|b| b[k]).fold(f64::INFINITY, f64::min);
    let high = |k: usize| boxes().map(|b| b[k] + b[k + 2]).fold(f64::NEG_INFINITY, f64::max);
    let mut extent = [[low(0), low(1)], [high(0), high(1)]];
    // A square at the end of a row may be white.
    if let Some([cols, rows, edge]) = checkered(target) {
        extent = [[0.0, 0.0], [cols * edge, rows * edge]];
    }
    Ok(Ink { extent, black, discs })
}

/// Columns, rows and edge of the squares of a board that has some.
fn checkered(target: &Target) -> Option<[f64; 3]> {
    use crate::calib::marker::board::MarkerBoard;
    match target {
        Target::Checkerboard { size, square } => {
            Some([f64::from(size.cols) + 1.0, f64::from(size.rows) + 1.0, *square])
        }
        Target::Markers { board: MarkerBoard::Charuco(b), scale } => {
            Some([f64::from(b.columns), f64::from(b.rows), b.square * scale])
        }
        _ => None,
    }
}

/// The black squares of a checkerboard.
fn squares(size: BoardSize, edge: f64) -> Vec<[f64; 4]> {
    let (cols, rows) = (size.cols.saturating_add(1), size.rows.saturating_add(1));
    (0..rows)
        .flat_map(|j| (0..cols).map(move |i| (i, j)))
        .filter(|(i, j)| (i + j) % 2 == 0)
        .map(|(i, j)| [f64::from(i) * edge, f64::from(j) * edge, edge, edge])
        .collect()
}

/// The smallest paper that fits, in the orientation of the board if possible.
fn paper(board: [f64; 2], edge: f64, unit: Unit, footer: f64) -> (String, [f64; 2]) {
    let margin = (edge / 2.0).max(BLANK);
    let need = [board[0] + 2.0 * margin, board[1] + 2.0 * margin + footer];
    let papers = if unit == Unit::In { IMPERIAL } else { METRIC };
    for (name, [short, long]) in papers {
        let (along, across) =
            if board[0] > board[1] { ([long, short], [short, long]) } else { ([short, long], [long, short]) };
        for page in [along, across] {
            // A micrometre of rounding does not call for larger paper.
            if need[0] <= page[0] + 1e-3 && need[1] <= page[1] + 1e-3 {
                return (name.to_owned(), page);
            }
        }
    }
    let own = [board[0] + 2.0 * edge.max(BLANK), board[1] + 2.0 * edge.max(BLANK) + footer];
    (format!("{:.0} x {:.0} mm", own[0], own[1]), own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::board::Kind;

    fn page(size: &str, square: &str) -> Page {
        Page::new(&Sheet::new(Kind::Checkerboard, size.parse().unwrap(), square.parse().unwrap())).unwrap()
    }

    #[test]
    fn squares_have_their_size_and_the_first_is_black() {
        let p = page("9x6", "25mm");
        assert_eq!((p.paper.as_str(), p.size), ("A4", [297.0, 210.0]));
        assert_eq!(p.black.len(), 35);
        assert_eq!(p.black[0], [23.5, 12.5, 25.0, 25.0]);
        assert_eq!(p.black[1], [73.5, 12.5, 25.0, 25.0]);
        // The last square of the first row (column 9) is white, that of the second row black.
        let at = |x: f64, y: f64| p.black.contains(&[x, y, 25.0, 25.0]);
        assert!(at(248.5, 37.5) && !at(248.5, 12.5));
    }

    #[test]
    fn rulers_are_as_long_as_they_say() {
        for (square, length, words) in [("25mm", 100.0, "ruler: 100 mm"), ("1in", 101.6, "ruler: 4 in")] {
            let p = page("8x5", square);
            let [from, to] = p.lines[0];
            assert!((to[0] - from[0] - length).abs() < 1e-9);
            assert!(p.texts[0].words.contains(words), "{:?}", p.texts);
        }
        assert_eq!(page("9x6", "2.5cm").texts[1].words, "9x6 inner corners, square 2.5 cm");
    }

    #[test]
    fn paper_grows_with_the_board_and_everything_lies_on_it() {
        for (size, square, paper) in [
            ("9x6", "20mm", "A4"),
            ("6x9", "20mm", "A4"),
            ("9x6", "1in", "Letter"),
            ("9x6", "30mm", "A3"),
            ("9x6", "1.2in", "Tabloid"),
            ("11x8", "60mm", "A0"),
            ("11x8", "50mm", "A1"),
            ("9x6", "110mm", "1320 x 1000 mm"),
            ("9x6", "50cm", "6000 x 4510 mm"),
            ("2x2", "1mm", "A4"),
            ("200x200", "0.5mm", "A4"),
        ] {
            let p = page(size, square);
            assert_eq!(p.paper, paper, "{size} {square}: {:?}", p.size);
            let inside =
                |[x, y]: [f64; 2]| x >= 4.9 && y >= 4.9 && x <= p.size[0] - 4.9 && y <= p.size[1] - 4.9;
            assert!(p.black.iter().all(|[x, y, w, h]| inside([*x, *y]) && inside([x + w, y + h])));
            assert!(p.lines.iter().flatten().all(|q| inside(*q)));
            assert!(p.texts.iter().all(|t| inside(t.at)));
            let bottom = p.black.iter().map(|b| b[1] + b[3]).fold(0.0, f64::max);
            assert!(
                p.lines.iter().flatten().all(|q| q[1] > bottom),
                "{size} {square}: the ruler touches the board"
            );
        }
    }

    #[test]
    fn impossible_boards_say_why() {
        let refused = |size: &str, square: &str| {
            Page::new(&Sheet::new(Kind::Checkerboard, size.parse().unwrap(), square.parse().unwrap()))
                .unwrap_err()
                .to_string()
        };
        assert!(refused("9x6", "25").contains("with a unit: write for example 25mm"));
        assert!(refused("9x6", "0.6m").contains("6.00 x 4.20 m, more than 5 m"));
        assert!(refused("9x6", "1e300m").contains("more than 5 m"));
        assert!(refused("9x6", "0.01mm").contains("cannot be printed"));
    }

    #[test]
    fn words_never_run_into_each_other_or_the_board() {
        for kind in Kind::ALL {
            for (size, square) in [("5x7", "20mm"), ("7x5", "20mm"), ("4x5", "0.8in"), ("5x4", "120mm")] {
                let sheet = Sheet::new(kind, size.parse().unwrap(), square.parse().unwrap());
                let p = Page::new(&sheet).unwrap();
                let boxes: Vec<_> = p
                    .texts
                    .iter()
                    .map(|t| [t.at[0], t.at[1] - t.size, t.at[0] + width(&t.words), t.at[1]])
                    .collect();
                let bottom = |k: usize| p.black.iter().map(move |b| b[k] + b[k + 2]);
                let discs = p.discs.iter().map(|d| d[1] + d[2]);
                let bottom = bottom(1).chain(discs).fold(0.0, f64::max);
                for (i, a) in boxes.iter().enumerate() {
                    assert!(a[0] >= 105.0 && a[2] <= p.size[0] - 4.9, "{kind} {size}: {:?}", p.texts[i]);
                    assert!(a[1] > bottom, "{kind} {size}: {:?} above {bottom}", p.texts[i]);
                    for b in &boxes[..i] {
                        let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
                        assert!(apart, "{kind} {size}: {:?}", p.texts);
                    }
                }
            }
        }
    }
}
