//! `straightedge twin`: the capture drawn anew with known truth, and calibrated again and again.

use std::{fmt::Write as _, ops::ControlFlow, path::PathBuf, process::ExitCode};

use super::{
    NO_RESULT, args, files, frames, print, say,
    text::{Table, paragraph},
};
use crate::{
    calib::{
        Error, Result,
        calibrate::{Loss, Options, Weights},
        camera::Model,
        json,
        number::{percent, significant, with_sigma},
        report::Report,
        twin::{Outcome, Seen, Twin},
    },
    job::evidence::{Case, evidence},
    worker::{side_by_side, threads},
};

/// Draw the capture anew with known truth, calibrate it again and again, and compare the scatter with the predicted σ
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Photographs or folders of them, or one calibration: the JSON of `calibrate` (--json, --out camera.json)
    #[arg(value_name = "PATHS", required = true)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    board: args::Board,
    /// Camera model of photographs
    #[arg(long, value_name = "MODEL", default_value = "brown5")]
    model: Model,
    /// How often the capture is drawn and calibrated
    #[arg(long, value_name = "N", default_value = "50", value_parser = clap::value_parser!(u16).range(3..=10_000))]
    runs: u16,
    /// Print JSON instead of text
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    detecting: args::Detecting,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let report = report(args)?;
    if let Some(error) = &report.error {
        say(&format!("error: {}", error.text));
        return Ok(ExitCode::from(NO_RESULT));
    }
    let twin = Twin::of(&report)?;
    let runs = usize::from(args.runs);
    let views: Vec<usize> = (0..twin.pictures()).collect();
    let bar = frames::counter("Drawing pictures", views.len());
    let go_on = &mut |_| ControlFlow::Continue(());
    let look = |view: &usize| twin.seen(*view, runs, &mut |_| ControlFlow::Continue(()));
    let lanes = threads(args.detecting.threads);
    let seen = side_by_side(lanes, &views, look, &mut |done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let seen: Vec<Seen> = seen.into_iter().collect::<Result<_>>()?;
    let bar = frames::waiting("Calibrating");
    let outcome = twin.outcome(&seen, go_on);
    bar.finish_and_clear();
    let outcome = outcome?;
    print(&if args.json { json::text(&outcome) } else { text(&outcome) })?;
    Ok(ExitCode::SUCCESS)
}

/// The calibration: read, or made of photographs.
fn report(args: &Args) -> Result<Report> {
    if let [path] = &args.paths[..]
        && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
    {
        let text = files::text(path)?;
        return Report::from_json(&text).map_err(|e| Error::File {
            path: path.display().to_string(),
            message: format!("{e}: give photographs, or the JSON of `straightedge calibrate`"),
        });
    }
    let sources = frames::sources(&args.paths)?;
    if sources.is_empty() {
        return Err(files::no_pictures(&args.paths));
    }
    let mut pool = frames::pool(args.detecting.threads);
    let inspected = frames::inspect(&mut pool, sources, args.detecting.options())?;
    let mut settings = args.detecting.settings();
    (settings.square, settings.unit) = args.board.square();
    let case = Case {
        board: args.board.board.0,
        models: vec![args.model],
        options: Options { loss: Loss::default(), weights: Weights::default(), ..Options::default() },
        ..Case::new(inspected.entries, settings)
    };
    Ok(evidence(&case, &mut |_| ControlFlow::Continue(()))?.report)
}

/// For people.
fn text(o: &Outcome) -> String {
    let mut out = format!(
        "{} runs of {} pictures with {} grey levels of noise; {} of the corners found again{}\n\n",
        o.runs,
        o.pictures,
        significant(o.noise_levels, 2),
        percent(o.found_fraction),
        if o.failed > 0 { format!("; {} more runs without a camera", o.failed) } else { String::new() }
    );
    let mut table = Table::new("lrrrrrr");
    table.row(["", "truth", "bias", "in errors", "scatter", "predicted σ", "σ of the capture"]);
    for p in &o.parameters {
        let two = |v: f64| significant(v, 2);
        table.row([
            p.name.clone(),
            with_sigma(p.truth, p.sigma)[0].clone(),
            two(p.bias),
            format!("{:+.1}", p.bias_in_errors(o.runs)),
            two(p.scatter),
            two(p.sigma),
            p.capture_sigma.map(two).unwrap_or_default(),
        ]);
    }
    out += &table.render();
    out += "\nProjection at the boards' distance, px\n";
    let mut table = Table::new("lrrr");
    table.row(["", "bias", "scatter", "predicted σ"]);
    for p in &o.places {
        let two = |v: f64| significant(v, 2);
        table.row([
            p.name.clone(),
            two(p.bias_px),
            two(p.scatter_px),
            p.sigma_px.map_or("-".to_owned(), two),
        ]);
    }
    out += &table.render();
    let [off, told] = o.corner_px.map(|px| significant(px, 2));
    let [capture, twin] = o.rms_per_coordinate_px;
    let _ = writeln!(
        out,
        "\nCorners are {off} px off the truth per coordinate (RMS), {} px of it in every run; predicted were {told} px.",
        significant(o.corner_bias_px, 2)
    );
    if let Some(words) = o.neighbour_words() {
        out += &paragraph("i", &words);
    }
    if capture > 1.5 * twin {
        out += &paragraph(
            "!",
            &format!(
                "The residuals of the capture are {} times those of its twin ({} and {} px per coordinate): more than the noise of its pictures explains. The board may not be flat, pictures may be moved or the lens of another kind",
                significant(capture / twin, 2),
                significant(capture, 2),
                significant(twin, 2)
            ),
        );
    }
    out
}
