//! `straightedge experiment`: the source document's Section V, measured.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    process::ExitCode,
};

use indicatif::ProgressBar;

use super::{frames, print};
use crate::calib::{
    Result,
    experiment::{self, Experiment, claims::Verdict, faults, sources, table},
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
    #[arg(long, conflicts_with_all = ["ablate", "advice"])]
    faults: bool,
    /// Instead: the source document's Table V with numbers, each source of error by itself on its scene
    #[arg(long, conflicts_with_all = ["ablate", "advice", "faults"])]
    sources: bool,
    /// Captures of each fault and strength, a tenth of those without a fault
    #[arg(long, value_name = "N", default_value_t = 60, requires = "faults")]
    captures: usize,
    /// Seed of the captures
    #[arg(long, value_name = "N", default_value_t = 1, requires = "faults")]
    seed: u64,
    /// Instead: whether the advice on what to photograph next saves pictures
    #[arg(long, conflicts_with = "ablate")]
    advice: bool,
    /// Folder for experiment.md, results.json and the figures, or for advice.md; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    if args.advice {
        return advice(args);
    }
    // Before the work, so that a wrong path costs nothing.
    let figures = args.out.join(FIGURES);
    store::folder(&args.out)?;
    if !args.faults && !args.sources {
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
        return written(&args.out.join("faults.md"), &study.markdown());
    }
    if args.sources {
        let page = sources::page(&mut |what| {
            bar.set_message(what.to_owned());
            bar.tick();
            ControlFlow::Continue(())
        });
        bar.finish_and_clear();
        return written(&args.out.join("sources.md"), &page);
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

/// Writes a page and prints it.
fn written(path: &Path, page: &str) -> Result<ExitCode> {
    store::write(path, page.as_bytes())?;
    print(page)?;
    Ok(ExitCode::SUCCESS)
}

fn advice(args: &Args) -> Result<ExitCode> {
    store::folder(&args.out)?;
    let bar = frames::waiting("");
    let pools = experiment::advice::study(&mut |what| {
        bar.set_message(what.to_owned());
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    let page = experiment::advice::page(&pools);
    store::write(&args.out.join("advice.md"), page.as_bytes())?;
    print(&page)?;
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
