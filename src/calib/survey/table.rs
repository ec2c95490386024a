//! CSV as programs and people write it: comma, semicolon, tab or spaces, with or without a header, `#` comments, quotes, and with a
//! semicolon or tab a decimal comma.

use crate::calib::{Error, Result};

/// The lines of a file with the columns that are wanted.
pub(super) struct Table<'a> {
    file: &'a str,
    names: Vec<&'a str>,
    /// Columns that every row needs.
    needed: usize,
    separator: Separator,
    /// Place of each wanted column in a line; `None` for an optional one that the header lacks.
    places: Vec<Option<usize>>,
    lines: Vec<(usize, &'a str)>,
}

#[derive(Clone, Copy, PartialEq)]
enum Separator {
    Char(char),
    Spaces,
}

impl Separator {
    /// That of a line: the strongest sign that is in it.
    fn of(line: &str) -> Self {
        [';', '\t', ','].into_iter().find(|c| line.contains(*c)).map_or(Self::Spaces, Self::Char)
    }

    fn split(self, line: &str) -> Vec<String> {
        let mut fields = vec![String::new()];
        let mut quoted = false;
        for c in line.chars() {
            let separates = match self {
                Self::Char(s) => c == s,
                Self::Spaces => c.is_whitespace(),
            };
            if c == '"' {
                quoted = !quoted;
            } else if separates && !quoted {
                fields.push(String::new());
            } else if let Some(last) = fields.last_mut() {
                last.push(c);
            }
        }
        if self == Self::Spaces {
            fields.retain(|f| !f.is_empty());
        }
        fields.into_iter().map(|f| f.trim().to_owned()).collect()
    }
}

impl<'a> Table<'a> {
    /// Looks at a file: its separator, and its header if it has one.
    ///
    /// # Errors
    /// [`Error::Format`] where there is no line.
    pub(super) fn new(
        text: &'a str,
        file: &'a str,
        needed: &[&'a str],
        optional: &[&'a str],
    ) -> Result<Self> {
        let names = [needed, optional].concat();
        let mut lines: Vec<(usize, &str)> = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
            .collect();
        let Some((_, first)) = lines.first() else {
            return Err(Error::format(
                file,
                format!("it is empty: lines of {} are expected", names.join(",")),
            ));
        };
        let separator = Separator::of(first);
        let head = separator.split(first);
        let mut places: Vec<Option<usize>> = (0..names.len()).map(Some).collect();
        // A line without any number where numbers belong is a header; where it has the names, they say the order.
        let numbers = head.iter().filter(|f| number(f, separator).is_some()).count();
        if numbers == 0 {
            lines.remove(0);
            let find = |name: &&str| head.iter().position(|h| h.eq_ignore_ascii_case(name));
            let found: Vec<Option<usize>> = names.iter().map(find).collect();
            if found[..needed.len()].iter().all(Option::is_some) {
                places = found;
            }
        }
        Ok(Self { file, names, needed: needed.len(), separator, places, lines })
    }

    /// The lines, in order.
    pub(super) fn rows(&self) -> impl Iterator<Item = Result<Row<'_>>> {
        self.lines.iter().map(|(line, text)| {
            let fields = self.separator.split(text);
            let row = Row { table: self, line: *line, fields };
            let missing = (0..self.needed).any(|k| row.field(k).is_none());
            if missing {
                let n = row.fields.len();
                return Err(row.wrong(&format!(
                    "{n} fields, {} are needed: {}",
                    self.needed,
                    self.names.join(",")
                )));
            }
            Ok(row)
        })
    }
}

/// One line.
pub(super) struct Row<'a> {
    table: &'a Table<'a>,
    /// Counted from 1.
    pub(super) line: usize,
    fields: Vec<String>,
}

impl Row<'_> {
    fn field(&self, column: usize) -> Option<&str> {
        self.fields.get(self.table.places[column]?).map(String::as_str).filter(|f| !f.is_empty())
    }

    /// Whether there is something in a column.
    pub(super) fn has(&self, column: usize) -> bool {
        self.field(column).is_some()
    }

    /// A column as it is; needed ones have something.
    pub(super) fn word(&self, column: usize) -> Result<&str> {
        self.field(column).ok_or_else(|| self.wrong(&format!("{} is missing", self.table.names[column])))
    }

    /// A column as a finite number.
    pub(super) fn number(&self, column: usize) -> Result<f64> {
        let text = self.word(column)?;
        number(text, self.table.separator).filter(|v| v.is_finite()).ok_or_else(|| {
            self.wrong(&format!("{} is \"{text}\", a number was expected", self.table.names[column]))
        })
    }

    /// An error that names file and line.
    pub(super) fn wrong(&self, message: &str) -> Error {
        Error::format(self.table.file, format!("line {}: {message}", self.line))
    }
}

fn number(text: &str, separator: Separator) -> Option<f64> {
    match separator {
        Separator::Char(',') => text.parse().ok(),
        _ => text.replace(',', ".").parse().ok(),
    }
}
