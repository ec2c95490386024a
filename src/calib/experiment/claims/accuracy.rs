//! Claims about the parameters.

use super::{Claim, Judgement};
use crate::calib::{
    Result,
    experiment::{
        document::{CENTER_PX, ESTIMATE, FOCAL_PERCENT, K1_ERROR, PARAMETERS, RMS_PX, TANGENTIAL_PERCENT},
        evidence::{EXACT, Evidence},
        table::two_digits,
    },
};

pub(super) const CLAIMS: &[Claim] = &[
    Claim { id: "focal", section: "V-C", says: "focal lengths within 0.013 %", judge: focal },
    Claim { id: "center", section: "V-C", says: "principal point within 0.213 px", judge: center },
    Claim { id: "k1", section: "V-C", says: "k1 within 3.7e-4", judge: k1 },
    Claim { id: "tangential", section: "V-C", says: "p1 within 2.0 %, p2 within 0.5 %", judge: tangential },
    Claim {
        id: "consistent_estimates",
        section: "V-C, V-D",
        says: "such parameters come with an RMS of 0.4832 px",
        judge: consistent,
    },
];

/// What the document's RMS lets one expect of parameters.
fn expected(e: &Evidence, names: &[&str]) -> String {
    let of = |name: &&str| {
        let i = PARAMETERS.iter().position(|p| p == name)?;
        let unit = e.runs[EXACT].camera().spec().params[i].unit;
        let miss = (ESTIMATE[i] - e.runs[EXACT].setup.scene.camera.params[i]).abs();
        let sigma = format!("{name} has σ = {} {unit}", two_digits(e.sigma_at_its_rms()[i]));
        let chance = 100.0 * e.chance(i);
        Some(format!("{}: an error of {miss:.2e} or less has a chance of {chance:.1} %", sigma.trim_end()))
    };
    format!("At {RMS_PX} px RMS {}.", names.iter().filter_map(of).collect::<Vec<_>>().join("; "))
}

fn focal(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, expected(e, &["fx", "fy"]), |run| {
        let relative = |name| run.parameter(name).map(|p| 100.0 * p.relative.unwrap_or(f64::INFINITY));
        let (fx, fy) = (relative("fx")?, relative("fy")?);
        Ok((format!("{fx:.4}, {fy:.4} %"), fx.max(fy) < FOCAL_PERCENT + 5e-4))
    })
}

fn center(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, expected(e, &["cx", "cy"]), |run| {
        let (cx, cy) = (run.parameter("cx")?.absolute, run.parameter("cy")?.absolute);
        Ok((format!("{cx:.3}, {cy:.3} px"), cx.max(cy) < CENTER_PX + 5e-4))
    })
}

fn k1(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, expected(e, &["k1"]), |run| {
        let miss = run.parameter("k1")?.absolute;
        Ok((format!("{miss:.1e}"), miss < K1_ERROR + 5e-6))
    })
}

fn tangential(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, expected(e, &["p1", "p2"]), |run| {
        let relative = |name| run.parameter(name).map(|p| 100.0 * p.relative.unwrap_or(f64::INFINITY));
        let got = [relative("p1")?, relative("p2")?];
        let holds = (0..2).all(|k| got[k] < TANGENTIAL_PERCENT[k] + 0.05);
        Ok((format!("{:.1}, {:.1} %", got[0], got[1]), holds))
    })
}

fn consistent(e: &Evidence) -> Result<Judgement> {
    let each: Vec<String> = PARAMETERS
        .iter()
        .zip(e.sigma_at_its_rms())
        .enumerate()
        .map(|(i, (name, sigma))| format!("{name} {} ({:.1} %)", two_digits(sigma), 100.0 * e.chance(i)))
        .collect();
    let Some((chance, distance)) = e.chance_of_all() else {
        return Ok(Judgement::plain(false, "The covariance is singular."));
    };
    let because = format!(
        "σ that each parameter has at that RMS with these poses, and the chance of an error as small as the document's: {}. All nine \
         together: squared distance {distance:.2} of χ² with 9 degrees of freedom, as small by a chance of {chance:.1e}.",
        each.join(", ")
    );
    Ok(Judgement::plain((0.001..0.999).contains(&chance), because))
}
