//! The source document's experiment, its whole Section V in one go, with every claim judged by measurement.
//!
//! 1. [`pipeline`]: pictures in memory, corners, camera, and what they are worth against the truth.
//! 2. [`evidence`]: all runs: the document's crude renderer (vertices cut or rounded to whole pixels) and the exact one, by the
//!    document's method and by this program.
//! 3. [`claims`]: a registry, one entry a claim with the function that judges it.
//! 4. [`table`], [`figures`], [`page`]: Tables I to IV with the document's figures ([`document`]) beside the measured ones,
//!    Figures 2 to 8, and the report.
//! 5. [`ablate`]: one thing changed at a time.
//!
//! Everything is computed in memory; the command line writes it.

pub mod ablate;
pub mod advice;
pub mod claims;
pub mod document;
pub mod evidence;
pub mod faults;
pub mod figures;
pub mod page;
pub mod pipeline;
pub mod sources;
pub mod table;

use serde::Serialize;
use std::ops::ControlFlow;

use super::{Error, Result};
use ablate::{Effect, Numbers};
use claims::Judged;
use evidence::{COLUMNS, Evidence};
use figures::Figure;
use pipeline::{Bench, ViewNumbers};

/// All that was found.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// The runs.
    pub evidence: Evidence,
    /// Every claim with its verdict.
    pub claims: Vec<Judged>,
    /// Effects of the ablations; empty where they were not asked for.
    pub effects: Vec<Effect>,
    /// The figures.
    pub figures: Vec<Figure>,
}

/// Runs the experiment, with its ablations where asked for. `report` is told what comes next and may stop it.
///
/// # Errors
/// [`Error::Stopped`] where `report` breaks; otherwise those of rendering and calibration, which this scene does not have.
pub fn run(with_ablations: bool, report: &mut dyn FnMut(&str) -> ControlFlow<()>) -> Result<Experiment> {
    let mut step = |what: &str| if report(what).is_break() { Err(Error::Stopped) } else { Ok(()) };
    let evidence = Evidence::measure(&mut Bench::default(), &mut step)?;
    step("claims")?;
    let claims = claims::judge(&evidence)?;
    let effects = if with_ablations { ablate::ablate(&mut step)? } else { Vec::new() };
    step("figures")?;
    let figures = figures::all(&evidence)?;
    Ok(Experiment { evidence, claims, effects, figures })
}

/// The results in numbers, for machines.
#[derive(Serialize)]
struct Results<'a> {
    columns: Vec<Column>,
    claims: &'a [Judged],
    #[serde(skip_serializing_if = "<[Effect]>::is_empty")]
    ablations: &'a [Effect],
}

#[derive(Serialize)]
struct Column {
    name: &'static str,
    #[serde(flatten)]
    numbers: Numbers,
    residuals: super::stats::ErrorStats,
    coverage: super::stats::Coverage,
    views: Vec<ViewNumbers>,
}

impl Experiment {
    /// The results as JSON.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the camera sizes contradict each other.
    pub fn json(&self) -> Result<String> {
        let columns: Result<Vec<Column>> = COLUMNS
            .into_iter()
            .zip(&self.evidence.runs)
            .map(|(name, run)| {
                Ok(Column {
                    name,
                    numbers: Numbers::of(run)?,
                    residuals: run.errors(),
                    coverage: run.coverage(),
                    views: run.view_numbers(),
                })
            })
            .collect();
        let results = Results { columns: columns?, claims: &self.claims, ablations: &self.effects };
        Ok(super::json::text(&results))
    }
}
