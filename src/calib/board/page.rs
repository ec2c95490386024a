//! What is where on the paper, mm from its top-left corner.

use super::{Kind, MAX_MM};
use crate::calib::{
    Error, Result,
    target::{BoardSize, Length, Unit},
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

/// Strip below the board for ruler and caption, mm.
const FOOTER: f64 = 10.0;
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
    /// Edge of a square.
    pub square: f64,
    /// Top-left corners of the black squares.
    pub black: Vec<[f64; 2]>,
    /// Thin lines of the ruler, from and to.
    pub lines: Vec<[[f64; 2]; 2]>,
    /// Texts.
    pub texts: Vec<Text>,
}

impl Page {
    /// Lays out a board of `size` inner corners.
    ///
    /// The board has a white margin of a square where the paper has room for it, and of half a square at least.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the square has no physical unit or the board is larger than 5 m.
    pub fn new(kind: Kind, size: BoardSize, square: Length) -> Result<Self> {
        let Kind::Checkerboard = kind;
        let Some(metres) = square.unit.metres() else {
            return Err(Error::Invalid(format!(
                "a printed board needs the size of its squares with a unit: write for example {}mm",
                square.value
            )));
        };
        let edge = 1000.0 * metres * square.value;
        let (cols, rows) = (size.cols.saturating_add(1), size.rows.saturating_add(1));
        let board = [f64::from(cols) * edge, f64::from(rows) * edge];
        if board.iter().any(|b| b.is_nan() || *b > MAX_MM) {
            return Err(Error::Invalid(format!(
                "{size} squares of {square} make a board of {:.2} x {:.2} m, more than 5 m: choose fewer or smaller squares",
                board[0] / 1000.0,
                board[1] / 1000.0
            )));
        }
        if edge < 0.1 {
            return Err(Error::Invalid(format!("squares of {square} cannot be printed: at least 0.1 mm")));
        }
        let (paper, page) = paper(board, edge, square.unit);
        let left = (page[0] - board[0]) / 2.0;
        let top = (page[1] - FOOTER - board[1]) / 2.0;
        let black = (0..rows)
            .flat_map(|j| (0..cols).map(move |i| (i, j)))
            .filter(|(i, j)| (i + j) % 2 == 0)
            .map(|(i, j)| [left + f64::from(i) * edge, top + f64::from(j) * edge])
            .collect();
        let mut page = Self { paper, size: page, square: edge, black, lines: Vec::new(), texts: Vec::new() };
        page.rule(square.unit);
        let caption = format!("{size} inner corners, square {square}");
        let x = page.size[0] - BLANK - 0.52 * FONT * caption.len() as f64;
        page.write(x, &caption);
        Ok(page)
    }

    /// Ruler with ticks and what to do with it.
    fn rule(&mut self, unit: Unit) {
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
        self.write(x(ticks) + 2.0, words);
    }

    fn write(&mut self, x: f64, words: &str) {
        self.texts.push(Text { at: [x, self.size[1] - BLANK], size: FONT, words: words.to_owned() });
    }
}

/// The smallest paper that fits, in the orientation of the board if possible.
fn paper(board: [f64; 2], edge: f64, unit: Unit) -> (String, [f64; 2]) {
    let margin = (edge / 2.0).max(BLANK);
    let need = [board[0] + 2.0 * margin, board[1] + 2.0 * margin + FOOTER];
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
    let own = [board[0] + 2.0 * edge.max(BLANK), board[1] + 2.0 * edge.max(BLANK) + FOOTER];
    (format!("{:.0} x {:.0} mm", own[0], own[1]), own)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(size: &str, square: &str) -> Page {
        Page::new(Kind::Checkerboard, size.parse().unwrap(), square.parse().unwrap()).unwrap()
    }

    #[test]
    fn squares_have_their_size_and_the_first_is_black() {
        let p = page("9x6", "25mm");
        assert_eq!((p.paper.as_str(), p.size, p.square), ("A4", [297.0, 210.0], 25.0));
        assert_eq!(p.black.len(), 35);
        assert_eq!(p.black[0], [23.5, 12.5]);
        assert_eq!(p.black[1], [73.5, 12.5]);
        // The last square of the first row (column 9) is white, that of the second row black.
        assert!(p.black.contains(&[248.5, 37.5]) && !p.black.contains(&[248.5, 12.5]));
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
            assert!(p.black.iter().all(|[x, y]| inside([*x, *y]) && inside([x + p.square, y + p.square])));
            assert!(p.lines.iter().flatten().all(|q| inside(*q)));
            assert!(p.texts.iter().all(|t| inside(t.at)));
            let bottom = p.black.iter().map(|b| b[1] + p.square).fold(0.0, f64::max);
            assert!(
                p.lines.iter().flatten().all(|q| q[1] > bottom),
                "{size} {square}: the ruler touches the board"
            );
        }
    }

    #[test]
    fn impossible_boards_say_why() {
        let refused = |size: &str, square: &str| {
            Page::new(Kind::Checkerboard, size.parse().unwrap(), square.parse().unwrap())
                .unwrap_err()
                .to_string()
        };
        assert!(refused("9x6", "25").contains("with a unit: write for example 25mm"));
        assert!(refused("9x6", "0.6m").contains("6.00 x 4.20 m, more than 5 m"));
        assert!(refused("9x6", "1e300m").contains("more than 5 m"));
        assert!(refused("9x6", "0.01mm").contains("cannot be printed"));
    }
}
