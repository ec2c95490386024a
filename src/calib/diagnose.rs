//! Verdict and findings.
#![allow(missing_docs)]
use super::{camera::Model, report::Report};
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Good,
    Info,
    Warn,
    Bad,
}
pub struct Verdict {
    pub level: Level,
    pub sentence: String,
    pub rms_alone: &'static str,
}
pub struct Finding {
    pub code: &'static str,
    pub level: Level,
    pub title: String,
    pub text: String,
    pub show: Show,
    pub remedy: Option<Remedy>,
}
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    Picture(usize),
    Errors,
    Coverage,
    Lens,
    Poses,
    Pictures,
}
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    Hold(Vec<String>),
    SetAside(Vec<usize>),
    AddPictures,
    Model(Model),
}
impl Remedy {
    pub fn label(&self) -> String {
        "Fix".into()
    }
}
pub fn verdict(report: &Report) -> Verdict {
    Verdict { level: Level::Warn, sentence: report.verdict(), rms_alone: "good" }
}
pub fn findings(_report: &Report) -> Vec<Finding> {
    Vec::new()
}
