//! The report as Markdown.

use super::{
    Experiment,
    ablate::CONDITIONS,
    claims::Verdict,
    evidence::COLUMNS,
    table::{self, Table},
};
use crate::calib::Result;
use std::fmt::Write;

/// The page; figures are referred to in `folder`, relative to it.
///
/// # Errors
/// Those of the tables.
pub fn markdown(x: &Experiment, folder: &str) -> Result<String> {
    let e = &x.evidence;
    let count = |f: fn(&Verdict) -> bool| x.claims.iter().filter(|c| f(&c.judgement.verdict)).count();
    let mut page = format!(
        "# The source document's experiment, measured\n\n\
         Made by `straightedge experiment{} --out DIR`; every figure on this page is measured in that run.\n\n\
         The document (*Quantitative verification of Zhang's camera calibration method using synthetic checkerboard images with known \
         parameters*) renders 15 views of a 9×6 board through a known camera and calibrates it back. Here the same scene is rendered twice: \
         **crude**, as the document does, by polygons whose vertices are cut or rounded to whole pixels; and **exact**, each pixel the mean of \
         the board over its area, seen through the full lens model. It is calibrated by **its method** (corners by gradients in a window of \
         ±11 px, least squares, no weights: what `cornerSubPix` and `calibrateCamera` do) and by **Straightedge** with its defaults.\n\n\
         Of {} claims {} hold, {} hold only with some column, {} do not hold.\n\n",
        if x.effects.is_empty() { "" } else { " --ablate" },
        x.claims.len(),
        count(|v| *v == Verdict::Holds),
        count(|v| matches!(v, Verdict::OnlyWith(_))),
        count(|v| *v == Verdict::DoesNotHold),
    );
    let mut add = |t: &Table| {
        let _ = write!(page, "## {}\n\n{}\n", t.title, t.markdown());
    };
    add(&table::claims(&x.claims));
    let mut why = String::from("### What decides\n\n");
    for claim in x.claims.iter().filter(|c| !c.judgement.because.is_empty()) {
        let _ = writeln!(why, "* **{}.** {}", capital(&claim.says), claim.judgement.because);
    }
    let _ = writeln!(page, "{why}");
    for t in [
        table::parameters(e)?,
        table::poses(e),
        table::settings(e),
        table::statistics(e),
        table::geometry(e)?,
        table::refinements(e),
    ] {
        let _ = write!(page, "## {}\n\n{}\n", t.title, t.markdown());
    }
    let _ = write!(
        page,
        "± is 1σ, a posteriori. Residuals and errors are lengths in px; the standard deviation is about the mean. Projection \
         uncertainty is 1σ in the worst direction, in the gauge of the boards, at their distance. Columns: {}.\n\n## Figures\n\n",
        COLUMNS.join(" · ")
    );
    for f in &x.figures {
        let _ = write!(page, "{}\n\n![{}]({folder}/{})\n\n", f.caption, f.caption, f.file);
    }
    if !x.effects.is_empty() {
        page += "## Ablations\n\n\
                 One thing changed at a time, exact renderer, Straightedge's defaults otherwise. Errors are found − true; in brackets in σ of that run. \
                 The map error is the RMS over the picture between where the camera found and the true one show the same rays. Random poses obey the \
                 document's Section IV-B; smaller sets are the first of the larger.\n\n";
        for (condition, _) in CONDITIONS {
            let t = table::effects(&x.effects, condition);
            let _ = write!(page, "### Pictures: {}\n\n{}\n", t.title, t.markdown());
        }
    }
    Ok(page)
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}
