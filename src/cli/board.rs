//! `straightedge board`: a board to print.

use std::{path::PathBuf, process::ExitCode};

use super::{files, print, say};
use crate::calib::{
    Error, Result,
    board::{self, Kind, Page},
    target::{BoardSize, Length, Unit},
};
use crate::job::store;

/// Papers that office printers hold.
const SMALL: [&str; 4] = ["A4", "Letter", "A3", "Tabloid"];

/// Write a board to print, at true scale, with a ruler to check the printer
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Kind of board: checkerboard
    #[arg(long, default_value_t)]
    kind: Kind,
    /// Inner corners, columns x rows
    #[arg(long, value_name = "CxR")]
    size: BoardSize,
    /// Edge of a square with its unit: 25mm, 2.5cm, 1in
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    square: Length,
    /// File to write: .pdf or .svg
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let Args { kind, size, square, out } = args;
    files::may_write(out, [])?;
    size.findable()?;
    let extension = out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let bytes = match extension.as_str() {
        "pdf" => board::pdf(*kind, *size, *square)?,
        "svg" => board::svg(*kind, *size, *square)?.into_bytes(),
        _ => {
            return Err(Error::Invalid(format!(
                "{}: a board is written as PDF or SVG: let the name end in .pdf or .svg",
                out.display()
            )));
        }
    };
    let page = Page::new(*kind, *size, *square)?;
    store::write(out, &bytes)?;
    let [w, h] = page.size;
    print(&format!(
        "{}: {kind}, {size} inner corners, square {square}, on {} ({w:.0} x {h:.0} mm)\n",
        out.display(),
        page.paper
    ))?;
    if !SMALL.contains(&page.paper.as_str()) {
        say(&format!(
            "note: the board does not fit on A4 or A3 (Letter, Tabloid){}",
            smaller(*kind, *size, *square)
        ));
    }
    if (size.cols + size.rows) % 2 == 0 {
        say(&format!(
            "note: {} {size} board looks the same upside down, so the order of its corners is a choice: one odd and one even number (for example {}x{}) tell which way is up",
            size.article(),
            size.cols + 1,
            size.rows
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Which squares would fit on the paper of an office printer.
fn smaller(kind: Kind, size: BoardSize, square: Length) -> String {
    let step = match square.unit {
        Unit::In => 0.125,
        Unit::Cm => 0.1,
        Unit::M => 0.001,
        _ => 1.0,
    };
    let fitting = |papers: &[&str]| {
        let steps = (1..=(square.value / step).min(1e4) as u32).rev();
        steps.map(|n| Length { value: (f64::from(n) * step * 1e6).round() / 1e6, ..square }).find(|length| {
            Page::new(kind, size, *length).is_ok_and(|page| papers.contains(&page.paper.as_str()))
        })
    };
    match (fitting(&["A4", "Letter"]), fitting(&["A3", "Tabloid"])) {
        (Some(a), Some(b)) => {
            format!(
                ": squares of {a} fit on A4 (Letter), of {b} on A3 (Tabloid); or have it printed by a shop"
            )
        }
        _ => ": choose fewer squares, or have it printed by a shop".to_owned(),
    }
}
