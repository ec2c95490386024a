//! Claims about what each step of the method gains.

use super::{Claim, Judgement, Verdict};
use crate::calib::{
    Result,
    detect::{Refinement, gradient::Window},
    experiment::{
        document::{PRECISION_PX, REFINEMENT_GAIN},
        evidence::Evidence,
        pipeline::Run,
    },
};

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "precision",
        section: "VI-A",
        says: "corners cannot be located better than 0.1 to 0.2 px at this resolution",
        judge: precision,
    },
    Claim {
        id: "refinement",
        section: "VII",
        says: "sub-pixel refinement reduces the localisation error by a factor of ten",
        judge: refinement,
    },
    Claim {
        id: "roll",
        section: "IV-B",
        says: "the roll of view 15 decouples fx and fy and improves the principal point",
        judge: roll,
    },
    Claim {
        id: "five_terms",
        section: "V-E, VII",
        says: "the five-term distortion model suffices",
        judge: five_terms,
    },
];

fn precision(e: &Evidence) -> Result<Judgement> {
    let because = "RMS distance of the corners found from their true places, after the shift that all corners of a crude picture share.";
    let columns = [
        (0, Refinement::Gradient(Window::Half(11))),
        (1, Refinement::Gradient(Window::Half(11))),
        (2, Refinement::Gradient(Window::Half(11))),
        (2, Refinement::Strip),
    ];
    let mut figures = Vec::new();
    for (renderer, refinement) in columns {
        let rms = e.refined(refinement)?.rms_px[renderer];
        figures.push((format!("{rms:.4} px"), rms >= PRECISION_PX[0]));
    }
    Ok(Judgement::by_column(four(figures), because))
}

fn refinement(e: &Evidence) -> Result<Judgement> {
    let off = e.refined(Refinement::Off)?.rms_px;
    let gain = |refinement: Refinement, renderer: usize| {
        Ok::<_, crate::calib::Error>(off[renderer] / e.refined(refinement)?.rms_px[renderer])
    };
    let its = Refinement::Gradient(Window::Half(11));
    let mut figures = Vec::new();
    for (renderer, refinement) in [(0, its), (1, its), (2, its), (2, Refinement::Strip)] {
        let gain = gain(refinement, renderer)?;
        figures.push((format!("{gain:.1} ×"), gain >= REFINEMENT_GAIN));
    }
    let because = format!(
        "RMS error of unrefined corners (peaks of the detector's response), common shift removed: {:.3} px (cut), {:.3} px (rounded), {:.3} px (exact), \
         divided by that of refined ones. No refiner can undo what a renderer has cut away.",
        off[0], off[1], off[2]
    );
    Ok(Judgement::by_column(four(figures), because))
}

fn four(figures: Vec<(String, bool)>) -> [(String, bool); 4] {
    let mut figures = figures.into_iter();
    std::array::from_fn(|_| figures.next().unwrap_or_default())
}

/// Correlation of fx and fy, and σ of fx, fx − fy, cx and cy for 1 px of noise.
fn focal_certainty(run: &Run) -> [f64; 5] {
    let c = run.calibration.covariance_of_all() / run.calibration.sigma0_px.powi(2);
    let at = |i: usize, j: usize| c[(i, j)];
    let sigma = |i: usize| at(i, i).sqrt();
    let difference = (at(0, 0) + at(1, 1) - 2.0 * at(0, 1)).max(0.0).sqrt();
    [at(0, 1) / (sigma(0) * sigma(1)), sigma(0), difference, sigma(2), sigma(3)]
}

fn roll(e: &Evidence) -> Result<Judgement> {
    let [with, without] = e.roll.each_ref().map(focal_certainty);
    let because = format!(
        "With the roll of view 15 and without it (view 15 frontal), for 1 px of noise: correlation of fx and fy {:.4} and {:.4}; σ of fx {:.2} and \
         {:.2} px, of fx − fy {:.3} and {:.3} px, of cx {:.2} and {:.2} px, of cy {:.2} and {:.2} px.",
        with[0],
        without[0],
        with[1],
        without[1],
        with[2],
        without[2],
        with[3],
        without[3],
        with[4],
        without[4]
    );
    // A tenth less is what anyone would call an effect.
    let better = |k: usize| with[k] < 0.9 * without[k];
    let (decouples, centres) = (with[0].abs() < 0.9 * without[0].abs(), better(3) || better(4));
    let verdict = match (decouples, centres) {
        (true, true) => Verdict::Holds,
        (false, false) => Verdict::DoesNotHold,
        (true, false) => Verdict::OnlyWith("fx and fy, not the principal point".to_owned()),
        (false, true) => Verdict::OnlyWith("the principal point, not fx and fy".to_owned()),
    };
    Ok(Judgement { verdict, columns: Vec::new(), because })
}

fn five_terms(e: &Evidence) -> Result<Judgement> {
    let list: Vec<String> = e
        .models
        .iter()
        .map(|m| {
            let excess = m.excess.map_or_else(String::new, |f| format!(" (F = {f:.1})"));
            format!("{}: {:.4} px{excess}", m.terms, m.rms_px)
        })
        .collect();
    let because = format!(
        "RMS on the exact pictures with ever more terms: {}. F is about 1 where the terms left out are not needed. They suffice because the pictures are made by \
         that very model; k3 is 0 in Table I, so the first four already do. Nothing here says anything about a real lens.",
        list.join("; ")
    );
    let last = e.models.last().map_or(f64::INFINITY, |m| m.rms_px);
    let found = e.refined(Refinement::Strip)?.rms_px[2];
    // All that is left is what the corners miss.
    Ok(Judgement::plain(last < 1.2 * found, because))
}
