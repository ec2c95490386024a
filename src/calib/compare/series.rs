//! Calibrations of one camera in the order of their dates: what changes, and when to calibrate again.

use serde::Serialize;

use super::{Chance, Comparison, Side, Verdict, compare, date, validity};
use crate::calib::{
    Result,
    figure::{Panel, Point, series as drawn},
    html::{self, escape},
    number::{significant, with_sigma},
    order,
    stats::{Trend, trend},
};

/// One calibration, before it is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Name of its file.
    pub file: String,
    /// The calibration.
    pub side: Side,
    /// When it was made, days since 1970; `None` where nobody knows.
    pub days: Option<f64>,
    /// How warm the camera was, °C.
    pub temperature: Option<f64>,
}

/// One calibration of a series, beside the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Its position among those that the series was made of.
    #[serde(skip)]
    pub given: usize,
    /// Name of its file.
    pub file: String,
    /// Its day, `2026-05-01`.
    pub date: Option<String>,
    /// How warm the camera was, °C.
    pub temperature: Option<f64>,
    /// Mean of `fx` and `fy`, and its σ where known.
    pub focal_px: (f64, Option<f64>),
    /// `cx` and `cy`, each with its σ where known.
    pub center_px: [(f64, Option<f64>); 2],
    /// RMS of the difference from the first over the picture, px; 0 for the first.
    pub whole_rms_px: f64,
    /// What chance lets expect of that, where σ is known; none for the first.
    pub chance: Option<Chance>,
    /// Whether it still is the first; of the first itself that chance explains all.
    pub verdict: Verdict,
}

/// Calibrations of one camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// In the order of their dates.
    pub entries: Vec<Entry>,
    /// Focal length over time, px per day; from four dated calibrations on.
    pub focal_by_day: Option<Trend>,
    /// Focal length over the temperature, px per °C; from four on.
    pub focal_by_temperature: Option<Trend>,
    /// Whether the last one lies outside of what chance explains of the first.
    pub recalibrate: bool,
    /// The days again, as numbers for figures.
    #[serde(skip)]
    days: Vec<Option<f64>>,
}

/// What changes over the temperature where that is known of all, else over time, else by number. Each point has a band that chance explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// What x is, with its unit.
    pub over: String,
    /// Mean of `fx` and `fy` with σ, px.
    pub focal: Vec<Point>,
    /// 2σ of the first, px.
    pub focal_bands: Vec<[f64; 2]>,
    /// Difference from the first, places weighted by their certainty, px.
    pub moved: Vec<Point>,
    /// What chance makes of it in 99 of 100 cases, px.
    pub moved_bands: Vec<[f64; 2]>,
}

impl Series {
    /// Puts calibrations into order and compares each with the first.
    ///
    /// # Errors
    /// Those of [`compare`], with the file.
    pub fn new(members: Vec<Member>) -> Result<Self> {
        let mut members: Vec<(usize, Member)> = members.into_iter().enumerate().collect();
        // Those without a date stay behind those with one, as they were given.
        order::by(&mut members, |(_, m)| [m.days.unwrap_or(f64::INFINITY)]);
        let Some(first) = members.first().map(|(_, m)| m.side.clone()) else {
            return Err(crate::calib::Error::Invalid("a series needs calibrations".to_owned()));
        };
        let mut entries = Vec::with_capacity(members.len());
        for (i, (given, member)) in members.iter().enumerate() {
            let beside = if i == 0 { None } else { Some(compare(&first, &member.side)?) };
            entries.push(entry(*given, member, beside.as_ref()));
        }
        let over = |x: &dyn Fn(&Member) -> Option<f64>| {
            let points: Vec<_> =
                members.iter().filter_map(|(_, m)| Some((x(m)?, validity::focal(&m.side.camera)))).collect();
            trend(&points)
        };
        Ok(Self {
            recalibrate: entries.last().is_some_and(|e| e.verdict == Verdict::Differ),
            focal_by_day: over(&|m| m.days),
            focal_by_temperature: over(&|m| m.temperature),
            days: members.iter().map(|(_, m)| m.days).collect(),
            entries,
        })
    }

    /// What it comes to, in a sentence.
    pub fn sentence(&self) -> String {
        let Some(last) = self.entries.last().filter(|_| self.entries.len() > 1) else {
            return "One calibration alone has nothing to be compared with.".to_owned();
        };
        let out = self.entries.iter().filter(|e| e.verdict == Verdict::Differ).count();
        match (last.verdict, &last.chance) {
            (Verdict::Differ, Some(c)) => format!(
                "Changed since {}: {} of {} differ from it by more than chance explains, the last by {} px where chance makes at most {}. \
                 Use the newest calibration, or recalibrate.",
                self.entries[0].file,
                out,
                self.entries.len() - 1,
                significant(c.moved_px, 2),
                significant(c.limit_px, 2)
            ),
            (Verdict::WithinChance, Some(c)) if out == 0 => format!(
                "Steady: the others agree with the first, the last to {} px; chance makes up to {}.",
                significant(c.moved_px, 2),
                significant(c.limit_px, 2)
            ),
            (Verdict::WithinChance, _) => format!(
                "The last one agrees with the first, but {out} in between did not: the camera changes and comes back."
            ),
            _ => "Whether it changed nobody can say: the files hold no covariance.".to_owned(),
        }
    }

    /// What changes over what.
    pub fn course(&self) -> Course {
        let all = |list: Vec<Option<f64>>| list.into_iter().collect::<Option<Vec<f64>>>();
        let start = self.days.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let temperatures = all(self.entries.iter().map(|e| e.temperature).collect());
        let days = all(self.days.iter().map(|d| d.map(|d| d - start)).collect());
        let (x, name) = match (temperatures, days) {
            (Some(list), _) => (list, "Temperature, °C".to_owned()),
            (None, Some(list)) => (list, format!("Days since {}", date::iso(start))),
            _ => ((1..=self.entries.len()).map(|i| i as f64).collect(), "Row of the table".to_owned()),
        };
        let points = |y: &dyn Fn(&Entry) -> (f64, f64)| -> Vec<Point> {
            let point = |(x, e): (&f64, &Entry)| {
                let (y, sigma) = y(e);
                Point { x: *x, y, sigma, good: e.verdict != Verdict::Differ }
            };
            x.iter().zip(&self.entries).map(point).collect()
        };
        let band = self.entries.first().map_or([0.0; 2], |e| {
            let (value, sigma) = (e.focal_px.0, 2.0 * e.focal_px.1.unwrap_or(0.0));
            [value - sigma, value + sigma]
        });
        let limit = |e: &Entry| [0.0, e.chance.map_or(0.0, |c| c.limit_px)];
        Course {
            focal: points(&|e| (e.focal_px.0, e.focal_px.1.unwrap_or(0.0))),
            focal_bands: vec![band; self.entries.len()],
            moved: points(&|e| (e.chance.map_or(e.whole_rms_px, |c| c.moved_px), 0.0)),
            moved_bands: self.entries.iter().map(limit).collect(),
            over: name,
        }
    }

    /// Its figures: focal length, and difference from the first.
    pub fn figures(&self) -> [Panel; 2] {
        let c = self.course();
        [
            drawn(&c.focal, &c.focal_bands, "Focal length", &c.over, "px"),
            drawn(&c.moved, &c.moved_bands, "Difference from the first", &c.over, "px"),
        ]
    }

    /// The series as one page.
    pub fn page(&self) -> String {
        let tone = if self.recalibrate { "bad" } else { "good" };
        let mut body = format!(
            "<h1>Calibrations of one camera</h1>\n<p class=\"verdict {tone}\">{}</p>\n",
            escape(&self.sentence())
        );
        let [focal, moved] = self.figures();
        let drawn = html::row(&[
            html::figure(&focal, "Mean of fx and fy with 1σ; the band is 2σ of the first."),
            html::figure(
                &moved,
                "Places weighted by their certainty; the bars are what chance makes in one of a hundred cases.",
            ),
        ]);
        let mut table = "<table><thead><tr><th>calibration</th><th>date</th><th class=\"n\">°C</th><th>focal length, px</th><th>cx</th><th>cy</th>\
                         <th class=\"n\">difference, px</th><th class=\"n\">by chance up to</th><th></th></tr></thead><tbody>\n"
            .to_owned();
        for e in &self.entries {
            let cells = e.cells();
            table += &format!(
                "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>\n",
                escape(&e.file),
                cells[0],
                cells[1],
                cells[2],
                cells[3],
                cells[4],
                cells[5],
                cells[6],
                e.word()
            );
        }
        body += &html::section("Over time", &(drawn + &table + "</tbody></table>\n"));
        html::document("Calibrations of one camera", env!("CARGO_PKG_VERSION"), &body, "")
    }
}

impl Entry {
    /// Date, temperature, focal length, centre x and y, difference, what chance makes: in words.
    pub fn cells(&self) -> [String; 7] {
        let with = |(value, sigma): (f64, Option<f64>)| match sigma {
            Some(sigma) if sigma > 0.0 => with_sigma(value, sigma).join(" ± "),
            _ => format!("{value:.3}"),
        };
        let moved = self.chance.map_or(self.whole_rms_px, |c| c.moved_px);
        [
            self.date.clone().unwrap_or_default(),
            self.temperature.map_or(String::new(), |t| format!("{t:.1}")),
            with(self.focal_px),
            with(self.center_px[0]),
            with(self.center_px[1]),
            significant(moved, 2),
            self.chance.map_or(String::new(), |c| significant(c.limit_px, 2)),
        ]
    }

    /// Whether it is the camera of the first.
    pub const fn word(&self) -> &'static str {
        match self.verdict {
            Verdict::Differ => "changed",
            Verdict::WithinChance => "",
            Verdict::Unknown => "no σ",
        }
    }
}

fn entry(given: usize, member: &Member, beside: Option<&Comparison>) -> Entry {
    let side = &member.side;
    let sigma = |i: usize| side.covariance.as_ref().map(|c| c[(i, i)].max(0.0).sqrt());
    let known = side.covariance.is_some();
    let [_, _, cx, cy] = side.camera.intrinsics();
    Entry {
        given,
        file: member.file.clone(),
        date: member.days.map(date::iso),
        temperature: member.temperature,
        focal_px: (validity::focal(&side.camera), known.then(|| validity::variance(side).sqrt())),
        center_px: [(cx, sigma(2)), (cy, sigma(3))],
        whole_rms_px: beside.map_or(0.0, |c| c.whole.rms_px),
        chance: beside.and_then(|c| c.chance),
        verdict: beside.map_or(Verdict::WithinChance, |c| c.verdict),
    }
}
