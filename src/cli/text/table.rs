//! Tables and paragraphs for a terminal of [`WIDTH`] columns.

/// Columns of the narrowest terminal that everything fits.
pub(in crate::cli) const WIDTH: usize = 100;
/// Space between columns.
const GAP: &str = "  ";

/// How a column is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) enum Align {
    Left,
    Right,
}

/// Rows of cells; the last column is wrapped where it reaches beyond [`WIDTH`].
pub(in crate::cli) struct Table {
    aligns: Vec<Align>,
    rows: Vec<Row>,
}

/// Cells, and a text that runs on from the column after them.
struct Row {
    cells: Vec<String>,
    note: Option<String>,
}

impl Table {
    /// `l` and `r` for each column.
    pub(in crate::cli) fn new(aligns: &str) -> Self {
        let aligns = aligns.chars().map(|c| if c == 'r' { Align::Right } else { Align::Left }).collect();
        Self { aligns, rows: Vec::new() }
    }

    pub(in crate::cli) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(Row { cells: cells.into_iter().map(Into::into).collect(), note: None });
    }

    /// Cells, then a text that takes the room of all columns that follow.
    pub(in crate::cli) fn note<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>, note: &str) {
        self.rows
            .push(Row { cells: cells.into_iter().map(Into::into).collect(), note: Some(note.to_owned()) });
    }

    /// The lines, each indented by two and ended.
    pub(in crate::cli) fn render(&self) -> String {
        let cell = |row: &Row, k: usize| row.cells.get(k).map_or(0, |c| width(c));
        let widths: Vec<usize> = (0..self.aligns.len())
            .map(|k| self.rows.iter().map(|row| cell(row, k)).max().unwrap_or(0))
            .collect();
        let last = self.aligns.len().saturating_sub(1);
        let mut out = String::new();
        for row in &self.rows {
            let mut line = GAP.to_owned();
            // The text that may be long: a note, or what stands left in the last column.
            let (cells, long) = match &row.note {
                Some(note) => (row.cells.len(), note.as_str()),
                None if self.aligns.get(last) == Some(&Align::Left) => {
                    (last, row.cells.get(last).map_or("", String::as_str))
                }
                None => (last + 1, ""),
            };
            for k in (0..cells).filter(|k| widths[*k] > 0) {
                let text = row.cells.get(k).map_or("", String::as_str);
                let pad = " ".repeat(widths[k] - width(text));
                match self.aligns[k] {
                    Align::Left => line.extend([text, &pad]),
                    Align::Right => line.extend([&pad, text]),
                }
                line += GAP;
            }
            let before = width(&line);
            let room = WIDTH.saturating_sub(before).max(20);
            line += &wrap(long, room).join(&format!("\n{}", " ".repeat(before)));
            out += line.trim_end();
            out.push('\n');
        }
        out
    }
}

/// Characters of a text; none of ours is wider than one column.
fn width(text: &str) -> usize {
    text.chars().count()
}

/// Lines of at most `room` characters, broken between words; a longer word stands alone.
pub(in crate::cli) fn wrap(text: &str, room: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last().map_or(0, |l| width(l));
        if line > 0 && line + 1 + width(word) > room {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

/// A paragraph without a mark.
pub(in crate::cli) fn sentence(text: &str) -> String {
    wrap(text, WIDTH).join("\n") + "\n"
}

/// A paragraph behind a mark: `! text`, wrapped and indented.
pub(in crate::cli) fn paragraph(mark: &str, text: &str) -> String {
    let indent = width(mark) + 1;
    let lines = wrap(text, WIDTH - indent);
    format!("{mark} {}\n", lines.join(&format!("\n{}", " ".repeat(indent))))
}

/// The end of a text that is too long, behind an ellipsis.
pub(in crate::cli) fn tail(text: &str, room: usize) -> String {
    let n = width(text);
    if n <= room {
        return text.to_owned();
    }
    std::iter::once('…').chain(text.chars().skip(n + 1 - room)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_the_last_one_wraps() {
        let mut table = Table::new("lrl");
        table.row(["a", "1.5", "short"]);
        table.row(["long name", "10.25", &"word ".repeat(30)]);
        let text = table.render();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  a            1.5  short");
        assert!(lines.len() == 3 && lines.iter().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(lines[2].starts_with(&format!("{}word", " ".repeat(20))));
    }

    #[test]
    fn notes_take_the_room_of_the_columns_behind_them() {
        let mut table = Table::new("lrr");
        table.row(["a", "1", "2"]);
        table.note(["b"], "a long reason");
        assert_eq!(table.render(), "  a  1  2\n  b  a long reason\n");
    }

    #[test]
    fn empty_columns_vanish() {
        let mut table = Table::new("lrr");
        table.row(["a", "", "1"]);
        assert_eq!(table.render(), "  a  1\n");
    }

    #[test]
    fn long_names_keep_their_end() {
        assert_eq!(tail("folder/picture.png", 8), "…ure.png");
        assert_eq!(tail("a.png", 8), "a.png");
        assert_eq!(paragraph("!", "one two"), "! one two\n");
    }
}
