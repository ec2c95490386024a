//! Photographs: skipped where they are not there.

use std::path::{Path, PathBuf};

use super::super::*;
use crate::job::photo::{self, Colours};

/// The folder of a set; a printed line and `None` where it is absent.
fn data(set: &str) -> Option<PathBuf> {
    let root = std::env::var_os("STRAIGHTEDGE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let folder = root.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no photographs in {} (set STRAIGHTEDGE_DATA)", folder.display());
    None
}

fn read(path: &Path) -> Gray {
    photo::read(path, Colours::Gray).unwrap().photo.into_gray()
}

fn pictures(set: &str) -> Vec<(String, Gray)> {
    let Some(folder) = data(set) else { return Vec::new() };
    let paths = photo::list(&[folder]).unwrap();
    paths.iter().map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), read(p))).collect()
}

#[test]
#[ignore = "a study"]
fn study() {
    use rustix::time::{ClockId, clock_gettime};
    let now = || {
        let t = clock_gettime(ClockId::ProcessCPUTime);
        t.tv_sec as f64 * 1e3 + t.tv_nsec as f64 / 1e6
    };
    for set in std::env::var("SETS").unwrap().split(',') {
        for (name, picture) in pictures(set) {
            let start = now();
            let found = find(&picture);
            let time = now() - start;
            let counts: Vec<String> = Dictionary::all()
                .filter_map(|d| {
                    let n = found.marks.iter().filter(|m| m.identify(d).is_some()).count();
                    (n > 0).then(|| format!("{d}:{n}"))
                })
                .collect();
            println!(
                "{set}/{name} {time:.1} ms, {} marks, {} crossings, {}",
                found.marks.len(),
                found.crossings.len(),
                counts.join(" ")
            );
        }
    }
}
