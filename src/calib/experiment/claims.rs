//! What the source document claims, one entry a claim, each with the function that judges it by measurement.

mod accuracy;
mod errors;
mod method;
mod pictures;

use serde::{Deserialize, Serialize};

use super::{
    evidence::{COLUMNS, Evidence},
    pipeline::Run,
};
use crate::calib::Result;

/// A sentence of the document that can be measured.
pub struct Claim {
    /// Stable name.
    pub id: &'static str,
    /// Where it stands.
    pub section: &'static str,
    /// What it says.
    pub says: &'static str,
    /// Measures it.
    judge: fn(&Evidence) -> Result<Judgement>,
}

/// Whether a claim is true.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// In every column.
    Holds,
    /// In none.
    DoesNotHold,
    /// In the named ones.
    OnlyWith(String),
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Holds => f.write_str("holds"),
            Self::DoesNotHold => f.write_str("does not hold"),
            Self::OnlyWith(what) => write!(f, "holds only with: {what}"),
        }
    }
}

/// What came of measuring a claim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// Whether it is true.
    pub verdict: Verdict,
    /// The figure of each of [`COLUMNS`]; empty where the claim is not about them.
    pub columns: Vec<String>,
    /// The numbers that decide, and what they mean.
    pub because: String,
}

/// A claim with its judgement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Name of the claim.
    pub id: String,
    /// Where it stands.
    pub section: String,
    /// What it says.
    pub says: String,
    /// What was found.
    #[serde(flatten)]
    pub judgement: Judgement,
}

/// Every claim, in the order of the document's sections.
pub const CLAIMS: &[&[Claim]] = &[pictures::CLAIMS, accuracy::CLAIMS, errors::CLAIMS, method::CLAIMS];

/// Judges every claim.
///
/// # Errors
/// Those of the measurements.
pub fn judge(evidence: &Evidence) -> Result<Vec<Judged>> {
    let one = |claim: &Claim| {
        Ok(Judged {
            id: claim.id.to_owned(),
            section: claim.section.to_owned(),
            says: claim.says.to_owned(),
            judgement: (claim.judge)(evidence)?,
        })
    };
    CLAIMS.iter().flat_map(|group| group.iter()).map(one).collect()
}

impl Judgement {
    /// From figures of the columns and whether each agrees with the claim.
    fn by_column(columns: [(String, bool); 4], because: impl Into<String>) -> Self {
        let good: Vec<_> = COLUMNS.iter().zip(&columns).filter(|(_, c)| c.1).map(|(name, _)| *name).collect();
        let verdict = match good.len() {
            0 => Verdict::DoesNotHold,
            4 => Verdict::Holds,
            _ => Verdict::OnlyWith(good.join(" · ")),
        };
        Self { verdict, columns: columns.map(|c| c.0).into(), because: because.into() }
    }

    /// The same, with a figure measured in each run.
    fn by_run(
        evidence: &Evidence,
        because: impl Into<String>,
        measure: impl Fn(&Run) -> Result<(String, bool)>,
    ) -> Result<Self> {
        let [a, b, c, d] = &evidence.runs;
        Ok(Self::by_column([measure(a)?, measure(b)?, measure(c)?, measure(d)?], because))
    }

    /// True or not, whatever the column.
    fn plain(holds: bool, because: impl Into<String>) -> Self {
        let verdict = if holds { Verdict::Holds } else { Verdict::DoesNotHold };
        Self { verdict, columns: Vec::new(), because: because.into() }
    }
}
