//! What each stage hands to the next, in a few lines; none where it has made nothing yet.

use crate::{
    app::state::State,
    calib::{
        number::{counted, percent, significant},
        stats::quantile,
    },
};

pub(super) fn read(state: &State) -> Option<Vec<String>> {
    let seen: Vec<_> = state.data.inspections.values().filter_map(|i| i.as_ref().ok()).collect();
    let [w, h] = seen.first()?.size_px;
    let others = seen.iter().filter(|i| i.size_px != [w, h]).count();
    let mut lines = vec![format!("{} in grey values, {w} × {h} px", counted(seen.len(), "picture"))];
    if others > 0 {
        lines.push(format!("{others} of another size"));
    }
    let ms: f64 = seen.iter().map(|i| i.read_ms).sum::<f64>() / seen.len() as f64;
    lines.push(format!("{} ms a picture", significant(ms, 2)));
    Some(lines)
}

pub(super) fn find(state: &State) -> Option<Vec<String>> {
    let seen: Vec<_> = state.data.inspections.values().filter_map(|i| i.as_ref().ok()).collect();
    let grids: Vec<_> = seen.iter().filter_map(|i| i.detection.grid.as_ref()).collect();
    let corners: usize = grids.iter().map(|g| g.corners.len()).sum();
    let ms: f64 = seen.iter().map(|i| i.detect_ms).sum::<f64>() / seen.len().max(1) as f64;
    (!grids.is_empty()).then(|| {
        vec![
            format!("{} of squares with {}", counted(grids.len(), "grid"), counted(corners, "corner")),
            format!("{} ms a picture, its refinement included", significant(ms, 2)),
        ]
    })
}

pub(super) fn refine(state: &State) -> Option<Vec<String>> {
    let report = state.data.answer.as_deref()?.report();
    let mut sigmas: Vec<f64> = report.included().flat_map(|f| f.corners.iter().map(|c| c.sigma_px)).collect();
    if sigmas.is_empty() {
        return None;
    }
    sigmas.sort_by(f64::total_cmp);
    let at = |q| significant(quantile(&sigmas, q), 2);
    Some(vec![
        format!("{} with numbers on the {}", counted(sigmas.len(), "corner"), report.settings.board_words()?),
        format!(
            "each with its own σ: {} px at the median, {} to {} px for nine in ten",
            at(0.5),
            at(0.05),
            at(0.95)
        ),
    ])
}

pub(super) fn solve(state: &State) -> Option<Vec<String>> {
    let (answer, solution) = state.data.solved()?;
    let mut lines = vec![format!(
        "A camera of {} and {}",
        counted(solution.camera.params.len(), "parameter"),
        counted(answer.report().included().count(), "pose")
    )];
    if let Some(rms) = solution.closed_form.rms_px {
        lines.push(format!("closed form {} px RMS without distortion", significant(rms, 3)));
    }
    lines.push(format!(
        "{} to {} px RMS; {} of {} starts agree",
        counted(solution.iterations, "step"),
        significant(solution.rms_px, 3),
        solution.starts.agreeing,
        solution.starts.tried
    ));
    Some(lines)
}

pub(super) fn check(state: &State) -> Option<Vec<String>> {
    let (answer, solution) = state.data.solved()?;
    let c = &solution.coverage;
    Some(vec![
        answer.evidence.verdict.sentence.clone(),
        format!("covariance of all parameters; σ of a coordinate {} px", significant(solution.sigma0_px, 2)),
        format!(
            "corners over {} of the width, {} of the height",
            percent(c.width_fraction),
            percent(c.height_fraction)
        ),
    ])
}

pub(super) fn straighten(state: &State) -> Option<Vec<String>> {
    let shown = state.data.straight.as_ref()?;
    let [w, h] = shown.raster.as_ref().ok()?.size_px;
    let doc = &state.doc;
    let mut lines =
        vec![format!("A picture without the lens, {}, {w} × {h} px, {}", doc.projection, doc.extent())];
    if let Some(r) = shown.valid {
        lines.push(format!("valid without a gap within {} × {} px", r.width, r.height));
    }
    Some(lines)
}
