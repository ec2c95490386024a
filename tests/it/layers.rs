//! `engine` and `calib` know no files, threads, clocks, printing, and nothing above them: their sources say so.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Paths that they may not name, alone or as the beginning of a longer path.
const FORBIDDEN: [&str; 14] = [
    "egui",
    "crate::job",
    "crate::worker",
    "crate::cli",
    "crate::app",
    "std::fs",
    "std::thread",
    "std::process",
    "std::net",
    "std::env",
    "std::io::stdout",
    "std::time::Instant",
    "std::time::SystemTime",
    "web_time",
];
/// Calls that they may not make, however they were imported.
const CALLS: [&str; 6] = ["println!", "print!", "eprintln!", "eprint!", "Instant::now", "SystemTime::now"];

/// What a source file names that it may not.
fn offences(source: &str) -> Vec<String> {
    let code: String = source.lines().map(without_comment).collect::<Vec<_>>().join("\n");
    let mut found: Vec<String> = uses(&code).into_iter().filter(|path| is_forbidden(path)).collect();
    let words = |text: &str| {
        FORBIDDEN
            .iter()
            .chain(&CALLS)
            .filter(|w| has_word(text, w))
            .map(|w| (*w).to_owned())
            .collect::<Vec<_>>()
    };
    found.extend(words(&code));
    found.sort();
    found.dedup();
    found
}

/// The code of a line; `//` inside an address is no comment.
fn without_comment(line: &str) -> &str {
    let comment = line.match_indices("//").find(|(at, _)| !line[..*at].ends_with(':'));
    comment.map_or(line, |(at, _)| &line[..at])
}

fn is_forbidden(path: &str) -> bool {
    FORBIDDEN.iter().any(|f| path == *f || path.strip_prefix(f).is_some_and(|rest| rest.starts_with("::")))
}

/// Whether a text has a path that is not part of a longer name.
fn has_word(text: &str, word: &str) -> bool {
    let of_name = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let before = text[..at].chars().next_back().is_some_and(of_name);
        let after = text[at + word.len()..].chars().next().is_some_and(of_name);
        !before && !after
    })
}

/// Every path that `use` declarations bring in, braces spelled out.
fn uses(code: &str) -> Vec<String> {
    let mut paths = Vec::new();
    for (at, _) in code.match_indices("use ") {
        if code[..at].chars().next_back().is_none_or(|c| c.is_whitespace() || c == '(')
            && let Some(end) = code[at..].find(';')
        {
            let tree: String = code[at + 4..at + end].split_whitespace().collect::<Vec<_>>().join(" ");
            expand("", &tree, &mut paths);
        }
    }
    paths
}

/// Spells out one use tree.
fn expand(prefix: &str, tree: &str, paths: &mut Vec<String>) {
    let tree = tree.trim().trim_start_matches("::");
    let Some(open) = tree.find('{') else {
        let path = tree.split(" as ").next().unwrap_or(tree).trim();
        let path = path.strip_suffix("::self").unwrap_or(path);
        let whole =
            if path == "self" { prefix.trim_end_matches("::").to_owned() } else { format!("{prefix}{path}") };
        paths.push(whole);
        return;
    };
    let inner = format!("{prefix}{}", tree[..open].trim());
    let body = tree[open + 1..].strip_suffix('}').unwrap_or(&tree[open + 1..]);
    let (mut depth, mut from) = (0, 0);
    for (at, c) in body.char_indices().chain([(body.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !body[from..at].trim().is_empty() {
                    expand(&inner, &body[from..at], paths);
                }
                from = at + 1;
            }
            _ => {}
        }
    }
}

/// Sources below a folder; tests of `calib` may print and read photographs.
fn sources(folder: &Path, list: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap_or_default();
        if name == "tests" {
            continue;
        }
        if path.is_dir() {
            sources(&path, list);
        } else if path.extension().is_some_and(|e| e == "rs") {
            list.push(path);
        }
    }
}

#[test]
fn engine_and_calib_know_nothing_above_them_and_no_system() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = vec![root.join("calib.rs")];
    sources(&root.join("calib"), &mut files);
    sources(&root.join("engine"), &mut files);
    assert!(files.len() > 100, "only {} sources were found", files.len());
    let bad: Vec<String> = files
        .iter()
        .flat_map(|file| {
            let found = offences(&fs::read_to_string(file).unwrap());
            let name = file.strip_prefix(&root).unwrap().display().to_string();
            found.into_iter().map(move |o| format!("{name}: {o}"))
        })
        .collect();
    assert!(
        bad.is_empty(),
        "engine and calib must not use files, threads, clocks, printing or what lies above it:\n{}",
        bad.join("\n")
    );
}

#[test]
fn the_check_finds_what_it_looks_for() {
    for (source, offence) in [
        ("use std::fs;", "std::fs"),
        ("use std::{\n    fmt,\n    fs::File,\n};", "std::fs::File"),
        ("use std::{io, {thread::{self, spawn}}};", "std::thread::spawn"),
        ("use crate::{calib::Error, job};", "crate::job"),
        ("use crate::{calib::Error, worker::Pool as P};", "crate::worker::Pool"),
        ("fn f() { let _ = std::fs::read(\"a\"); }", "std::fs"),
        ("fn f() { let _ = ::std::thread::spawn(|| ()); }", "std::thread"),
        ("use std::time::Instant;", "std::time::Instant"),
        ("fn f() { Instant::now(); }", "Instant::now"),
        ("fn f() { println!(\"a\"); }", "println!"),
        ("fn f() { std::println!(\"a\"); }", "println!"),
        ("use egui::Ui;", "egui::Ui"),
        ("fn f() { crate::cli::say(\"\"); }", "crate::cli"),
        ("fn f() { let a = \"https://b\"; std::env::var(a); }", "std::env"),
    ] {
        let found = offences(source);
        assert!(found.iter().any(|f| f == offence), "{source}: {found:?}");
    }
}

#[test]
fn the_check_lets_good_code_pass() {
    for source in [
        "// std::fs is not used\n/// no println! here\nuse std::fmt;",
        "use std::{fmt::Write as _, str::FromStr};",
        "use super::jobs; fn reprint!() {} fn my_std::fsx() {}",
        "fn f() { my_println!(\"\"); let reuse = 1; }",
        "use std::time::Duration;",
    ] {
        assert_eq!(offences(source), [""; 0], "{source}");
    }
}
