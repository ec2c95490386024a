//! `straightedge board`: a board to print.

use std::{path::PathBuf, process::ExitCode};

use super::{files, print, say};
use crate::calib::{
    Error, Result,
    board::{self, Design, Kind, Page, Sheet},
    marker::dictionary::Dictionary,
    target::{BoardSize, Length, Target, Unit},
};
use crate::job::store;

/// Papers that office printers hold.
const SMALL: [&str; 4] = ["A4", "Letter", "A3", "Tabloid"];

/// Write a board to print, at true scale, with a ruler to check the printer
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Kind of board: checkerboard, charuco, aprilgrid, aruco-grid, circles, acircles
    #[arg(long, default_value_t)]
    kind: Kind,
    /// Columns x rows: of a checkerboard inner corners, of the others squares (charuco), tags, markers or circles
    #[arg(long, value_name = "CxR")]
    size: BoardSize,
    /// Edge of a square (of a tag, of a marker; spacing of circles) with its unit: 25mm, 2.5cm, 1in
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    square: Length,
    /// charuco: edge of a marker [default: 3/4 of a square]
    #[arg(long, value_name = "LENGTH", group = "inner")]
    marker: Option<Length>,
    /// aprilgrid, aruco-grid: gap between tags [default: 0.3 of a tag] or markers [default: 0.4 of a marker]
    #[arg(long, value_name = "LENGTH", group = "inner")]
    gap: Option<Length>,
    /// circles, acircles: diameter [default: 0.6 of the distance of neighbours]
    #[arg(long, value_name = "LENGTH", group = "inner")]
    diameter: Option<Length>,
    /// Boards of markers: 4x4_50 to 7x7_1000, 36h11, … [default: 5x5_250, of an aprilgrid 36h11]
    #[arg(long, value_name = "NAME")]
    dictionary: Option<Dictionary>,
    /// Boards of markers: id of the first one
    #[arg(long, value_name = "ID", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..1_000_000))]
    first_id: u32,
    /// charuco: the layout before OpenCV 4.6
    #[arg(long)]
    legacy: bool,
    /// File to write: .pdf or .svg
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Args {
    /// The board that is asked for.
    fn sheet(&self) -> Result<Sheet> {
        let Self { kind, size, square, marker, gap, diameter, dictionary, first_id, legacy, .. } = self;
        let grid = matches!(kind, Kind::AprilGrid | Kind::ArucoGrid);
        let circles = matches!(kind, Kind::Circles | Kind::AsymmetricCircles);
        for (option, given, fits) in [
            ("--marker", marker.is_some(), *kind == Kind::Charuco),
            ("--gap", gap.is_some(), grid),
            ("--diameter", diameter.is_some(), circles),
            ("--dictionary", dictionary.is_some(), kind.has_markers()),
            ("--first-id", *first_id > 0, kind.has_markers()),
            ("--legacy", *legacy, *kind == Kind::Charuco),
        ] {
            if given && !fits {
                return Err(Error::Invalid(format!(
                    "{option} says nothing about a board of kind {kind}: leave it out"
                )));
            }
        }
        if *kind == Kind::Checkerboard {
            size.findable()?;
        }
        let design = Design {
            dictionary: *dictionary,
            first_id: *first_id,
            legacy: Some(*legacy),
            ..Design::new(*kind, *size)
        };
        let sheet = Sheet { design, square: *square };
        marker.or(*gap).or(*diameter).map_or(Ok(sheet), |inner| sheet.with_inner(inner))
    }
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let out = &args.out;
    files::may_write(out, [])?;
    let sheet = args.sheet()?;
    let extension = out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let bytes = match extension.as_str() {
        "pdf" => board::pdf(&sheet)?,
        "svg" => board::svg(&sheet)?.into_bytes(),
        _ => {
            return Err(Error::Invalid(format!(
                "{}: a board is written as PDF or SVG: let the name end in .pdf or .svg",
                out.display()
            )));
        }
    };
    let page = Page::new(&sheet)?;
    store::write(out, &bytes)?;
    let [w, h] = page.size;
    print(&format!(
        "{}: {}, {}, on {} ({w:.0} x {h:.0} mm)\n",
        out.display(),
        sheet.design.kind,
        sheet.words()?.join(", "),
        page.paper
    ))?;
    if !SMALL.contains(&page.paper.as_str()) {
        say(&format!("note: the board does not fit on A4 or A3 (Letter, Tabloid){}", smaller(&sheet)));
    }
    if looks_the_same(&sheet.target()?) {
        let size = sheet.design.size;
        say(&format!(
            "note: {} {size} board looks the same upside down, so the order of its corners is a choice: one odd and one even number (for example {}x{}) tell which way is up",
            size.article(),
            size.cols + 1,
            size.rows
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether half a turn changes nothing, and another size would help.
fn looks_the_same(target: &Target) -> bool {
    match target {
        Target::Checkerboard { size, .. } => (size.cols + size.rows).is_multiple_of(2),
        Target::Markers { .. } | Target::Circles { .. } | Target::Points { .. } => false,
    }
}

/// Which squares would fit on the paper of an office printer.
fn smaller(sheet: &Sheet) -> String {
    let square = sheet.square;
    let step = match square.unit {
        Unit::In => 0.125,
        Unit::Cm => 0.1,
        Unit::M => 0.001,
        _ => 1.0,
    };
    let fitting = |papers: &[&str]| {
        let steps = (1..=(square.value / step).min(1e4) as u32).rev();
        steps.map(|n| Length { value: (f64::from(n) * step * 1e6).round() / 1e6, ..square }).find(|length| {
            Page::new(&Sheet { square: *length, ..*sheet })
                .is_ok_and(|page| papers.contains(&page.paper.as_str()))
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
