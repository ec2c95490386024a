//! A comparison as figures and as a page.

use super::{Comparison, Verdict};
use crate::calib::{
    figure::{Grid, Panel, Scale, map},
    html::{self, escape},
    number::{significant, with_sigma},
};

/// The map of the difference, and σ of each side where it is known, with their captions.
pub fn figures(comparison: &Comparison) -> Vec<(Panel, String)> {
    let size = comparison.image_size_px;
    let drawn = |title: &str, unit: &str, grid: &Grid| map(title, unit, grid, size, Scale::Sequential);
    let mut list = vec![(
        drawn("Difference", "px", &comparison.lengths()),
        "How far the second calibration puts what the first sees in a place, after the rotation between both.".to_owned(),
    )];
    for (side, which) in ["first", "second"].into_iter().enumerate() {
        if let Some(grid) = comparison.sigma(side) {
            let caption = format!("By how much the {which} would scatter if it were repeated.");
            list.push((drawn(&format!("σ of the {which}"), "1 σ, px", &grid), caption));
        }
    }
    list
}

/// The page; `names` are those of the two files.
pub fn page(names: [&str; 2], comparison: &Comparison) -> String {
    let tone = match comparison.verdict {
        Verdict::WithinChance => "good",
        Verdict::Differ => "bad",
        Verdict::Unknown => "care",
    };
    let [w, h] = comparison.image_size_px;
    let mut body = format!(
        "<h1>Two calibrations</h1>\n<p class=\"muted\">{} and {}, {w} × {h} px</p>\n<p class=\"verdict {tone}\">{}</p>\n",
        escape(names[0]),
        escape(names[1]),
        escape(&comparison.sentence())
    );
    let drawn: Vec<String> =
        figures(comparison).iter().map(|(p, caption)| html::figure(p, caption)).collect();
    body += &html::section("Difference over the picture", &(table(comparison) + &html::row(&drawn)));
    body += &html::section("Parameters", &parameters(comparison, names));
    html::document("Two calibrations", env!("CARGO_PKG_VERSION"), &body, "")
}

fn table(c: &Comparison) -> String {
    let mut out = "<table><thead><tr><th>px</th><th class=\"n\">mean</th><th class=\"n\">RMS</th><th class=\"n\">largest</th></tr></thead><tbody>\n".to_owned();
    for (name, f) in [("middle half", c.middle), ("whole picture", c.whole), ("four corners", c.corners)] {
        let [mean, rms, max] = [f.mean_px, f.rms_px, f.max_px].map(|v| significant(v, 3));
        out += &format!(
            "<tr><th>{name}</th><td class=\"n\">{mean}</td><td class=\"n\">{rms}</td><td class=\"n\">{max}</td></tr>\n"
        );
    }
    out + "</tbody></table>\n"
}

fn parameters(c: &Comparison, names: [&str; 2]) -> String {
    let mut out = format!(
        "<table><thead><tr><th></th><th>{}</th><th>{}</th><th class=\"n\">difference in σ</th></tr></thead><tbody>\n",
        escape(names[0]),
        escape(names[1])
    );
    for p in &c.parameters {
        let shown = |i: usize| match p.sigma[i] {
            Some(sigma) if sigma > 0.0 => with_sigma(p.values[i], sigma).join(" ± "),
            _ => p.values[i].to_string(),
        };
        let in_sigma = p.in_sigma.map_or(String::new(), |s| format!("{s:.1}"));
        out += &format!(
            "<tr><th>{}</th><td>{}</td><td>{}</td><td class=\"n\">{in_sigma}</td></tr>\n",
            p.name,
            shown(0),
            shown(1)
        );
    }
    out + "</tbody></table>\n"
}

impl Comparison {
    /// What it comes to, in a sentence.
    pub fn sentence(&self) -> String {
        let whole = significant(self.whole.rms_px, 2);
        match (&self.chance, self.verdict) {
            (Some(c), Verdict::WithinChance) => format!(
                "Within what chance explains: they differ by {} px, places weighted by their certainty; chance makes up to {}.",
                significant(c.moved_px, 2),
                significant(c.limit_px, 2)
            ),
            (Some(c), _) => format!(
                "They differ: by {} px, places weighted by their certainty, where chance makes at most {} ({} px over the whole picture).",
                significant(c.moved_px, 2),
                significant(c.limit_px, 2),
                whole
            ),
            (None, _) => format!(
                "They differ by {whole} px over the picture; whether that is chance nobody can say, because neither file holds the covariance of its parameters."
            ),
        }
    }
}
