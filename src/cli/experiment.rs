//! `straightedge experiment`: the source document's Section V, measured.

use std::{ops::ControlFlow, path::PathBuf, process::ExitCode};

use indicatif::ProgressBar;

use super::print;
use crate::calib::{
    Result,
    experiment::{self, Experiment, claims::Verdict, faults, table},
};
use crate::job::store;

/// Name of the folder of figures beside the page.
const FIGURES: &str = "figures";

/// Repeat the source document's experiment and judge each of its claims by measurement
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Also change one thing at a time: refinement, smoothing, solver, origin, number of views
    #[arg(long)]
    ablate: bool,
    /// Instead: plant faults in captures, and count how often they are named
    #[arg(long, conflicts_with = "ablate")]
    faults: bool,
    /// Captures of each fault and strength, and a tenth of those without a fault
    #[arg(long, value_name = "N", default_value_t = 30, requires = "faults")]
    captures: usize,
    /// Seed of the captures
    #[arg(long, value_name = "N", default_value_t = 1, requires = "faults")]
    seed: u64,
    /// Folder for experiment.md, results.json and the figures; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    // Before the work, so that a wrong path costs nothing.
    let figures = args.out.join(FIGURES);
    store::folder(&args.out)?;
    if !args.faults {
        store::folder(&figures)?;
    }
    let bar = ProgressBar::new_spinner();
    if args.faults {
        let study = faults::run(args.captures, args.seed, &mut |what| {
            bar.set_message(what.to_owned());
            bar.tick();
            ControlFlow::Continue(())
        });
        bar.finish_and_clear();
        let page = study.markdown();
        store::write(&args.out.join("faults.md"), page.as_bytes())?;
        print(&page)?;
        return Ok(ExitCode::SUCCESS);
    }
    let found = experiment::run(args.ablate, &mut |what| {
        bar.set_message(what.to_owned());
        bar.tick();
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    for figure in &found.figures {
        store::write(&figures.join(&figure.file), figure.panel.svg().as_bytes())?;
    }
    store::write(&args.out.join("experiment.md"), experiment::page::markdown(&found, FIGURES)?.as_bytes())?;
    store::write(&args.out.join("results.json"), found.json()?.as_bytes())?;
    print(&summary(&found)?)?;
    Ok(ExitCode::SUCCESS)
}

/// What was found, in a few lines.
fn summary(found: &Experiment) -> Result<String> {
    let mut text = String::new();
    for t in [table::statistics(&found.evidence), table::parameters(&found.evidence)?] {
        text += &format!("{}\n{}\n", t.title, t.text());
    }
    text += "Claims\n";
    for claim in &found.claims {
        let mark = match claim.judgement.verdict {
            Verdict::Holds => "holds",
            Verdict::OnlyWith(_) => "partly",
            Verdict::DoesNotHold => "no",
        };
        text += &format!("  {mark:7}{}\n", claim.says);
    }
    Ok(text)
}
