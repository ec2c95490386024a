//! Whether an old calibration still holds for new pictures.

use std::ops::ControlFlow;

use super::evidence::{Case, Evidence, evidence};
use crate::calib::{
    Error, Result,
    calibrate::Fix,
    compare::{Side, Validity, judge},
    format,
};

/// [`validate`] with the text of the old calibration's file, from which the case then starts.
///
/// # Errors
/// Those of [`format::read`] and [`validate`].
pub fn held(
    mut case: Case,
    file: &str,
    text: &str,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<(Validity, Evidence)> {
    let old = format::read(text, file)?;
    case.start = Some((file.to_owned(), old.camera.clone()));
    validate(&case, &Side::from(&old), tick)
}

/// Solves new pictures with the camera that the case starts from held, then with its parameters free, and judges.
///
/// Answers the judgement with the solution that held the camera. Parameters that `old` knows exactly stay held. Where the pictures do
/// not determine the rest, the focal lengths alone are free.
///
/// # Errors
/// Why the new pictures cannot be used at all; [`Error::Stopped`] where `tick` breaks.
pub fn validate(
    case: &Case,
    old: &Side,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<(Validity, Evidence)> {
    let params = old.camera.spec().params;
    let solved = |held: &dyn Fn(usize) -> bool, tick: &mut dyn FnMut(f32) -> ControlFlow<()>| {
        let mut case = Case { models: vec![old.camera.model], ..case.clone() };
        let names = params.iter().enumerate().filter(|(i, _)| held(*i));
        case.options.fixed = names.map(|(_, p)| Fix::Hold(p.name.to_owned())).collect();
        // It is to be judged, not looked for.
        case.options.multi_start = false;
        evidence(&case, tick)
    };
    let held = solved(&|_| true, tick)?;
    if let Some(failure) = &held.report.error {
        return Err(Error::NoBoard(failure.text.clone()));
    }
    let exact = |i: usize| old.covariance.as_ref().is_some_and(|c| c[(i, i)] == 0.0);
    let mut free = solved(&exact, tick)?;
    let mut why = free.report.error.take().map(|f| f.text);
    if why.is_some() {
        let focal = solved(&|i| i > 1 || exact(i), tick)?;
        if focal.report.error.is_none() {
            free = focal;
        }
    }
    let validity = match &free.report.solution {
        Some(_) => {
            let mut found = judge(old, &held.report, Ok(&free.report))?;
            found.why = why.map(|why| format!("only the focal lengths were free: {why}"));
            found
        }
        None => judge(old, &held.report, Err(why.take().unwrap_or_default()))?,
    };
    Ok((validity, held))
}
